"""The literature a report may cite; a DOI stands only where we are sure of it."""

from ..scene import Citation

_POITIERS = ("Mickaël Ribardière", "Benjamin Bringier", "Daniel Meneveaux", "Lionel Simonot")
_TOG = "ACM Transactions on Graphics"

REFERENCES = (
    Citation(
        "microsurf", "misc", ("The microsurf authors",),
        "microsurf: explicit Student-t microsurfaces against microfacet theory",
        "software", "", 2026, "this tool",
    ),
    Citation(
        "wald2014", "article",
        ("Ingo Wald", "Sven Woop", "Carsten Benthin", "Gregory S. Johnson", "Manfred Ernst"),
        "Embree: A Kernel Framework for Efficient CPU Ray Tracing", _TOG, "33(4)", 2014,
        "ray tracing of the surface", "10.1145/2601097.2601199",
    ),
    Citation(
        "ribardiere2017", "article", _POITIERS,
        "STD: Student's t-Distribution of Slopes for Microfacet Based BSDFs",
        "Computer Graphics Forum", "36(2)", 2017, "distribution of slopes", "10.1111/cgf.13137",
    ),
    Citation(
        "ribardiere2018", "inproceedings",
        ("Mickaël Ribardière", "Benjamin Bringier", "Lionel Simonot", "Daniel Meneveaux"),
        "Appearance of Interfaced Lambertian Microfacets using STD Distribution",
        "Workshop on Material Appearance Modeling", "", 2018,
        "interfaced Lambertian facets with STD slopes",
    ),
    Citation(
        "ribardiere2019", "article", _POITIERS,
        "Microfacet BSDFs Generated from NDFs and Explicit Microgeometry", _TOG, "38(5)", 2019,
        "explicit surfaces with a given distribution of slopes", "10.1145/3338697",
    ),
    Citation(
        "meneveaux2018", "article",
        ("Daniel Meneveaux", "Benjamin Bringier", "Emmanuelle Tauzia", "Mickaël Ribardière",
         "Lionel Simonot"),
        "Rendering Rough Opaque Materials with Interfaced Lambertian Microfacets",
        "IEEE Transactions on Visualization and Computer Graphics", "24(3), 1368–1380", 2018,
        "interfaced Lambertian facets", "10.1109/TVCG.2017.2660490",
    ),
    Citation(
        "simonot2009", "article", ("Lionel Simonot",),
        "Photometric model of diffuse surfaces described as a distribution of interfaced "
        "Lambertian facets",
        "Applied Optics", "48(30), 5793–5801", 2009, "interfaced Lambertian facets",
        "10.1364/AO.48.005793",
    ),
    Citation(
        "smith1967", "article", ("Bruce G. Smith",),
        "Geometrical shadowing of a random rough surface",
        "IEEE Transactions on Antennas and Propagation", "15(5), 668–671", 1967,
        "masking and shadowing", "10.1109/TAP.1967.1138991",
    ),
    Citation(
        "heitz2014", "article", ("Eric Heitz",),
        "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs",
        "Journal of Computer Graphics Techniques", "3(2), 48–107", 2014,
        "height-correlated masking and shadowing",
    ),
    Citation(
        "torrance1967", "article", ("Kenneth E. Torrance", "Ephraim M. Sparrow"),
        "Theory for off-specular reflection from roughened surfaces",
        "Journal of the Optical Society of America", "57(9), 1105–1114", 1967,
        "V-cavities", "10.1364/JOSA.57.001105",
    ),
    Citation(
        "heitz2016", "article",
        ("Eric Heitz", "Johannes Hanika", "Eugene d'Eon", "Carsten Dachsbacher"),
        "Multiple-scattering microfacet BSDFs with the Smith model", _TOG, "35(4)", 2016,
        "random walk of all orders", "10.1145/2897824.2925943",
    ),
    Citation(
        "guo2018", "article", ("Yu Guo", "Miloš Hašan", "Shuang Zhao"),
        "Position-Free Monte Carlo Simulation for Arbitrary Layered BSDFs", _TOG, "37(6)", 2018,
        "layers that know nothing of each other", "10.1145/3272127.3275053",
    ),
    Citation(
        "walter2007", "inproceedings",
        ("Bruce Walter", "Stephen R. Marschner", "Hongsong Li", "Kenneth E. Torrance"),
        "Microfacet Models for Refraction through Rough Surfaces",
        "Eurographics Symposium on Rendering", "195–206", 2007, "GGX, which is STD at γ = 2",
        "10.2312/EGWR/EGSR07/195-206",
    ),
    Citation(
        "oren1994", "inproceedings", ("Michael Oren", "Shree K. Nayar"),
        "Generalization of Lambert's reflectance model", "SIGGRAPH", "239–246", 1994,
        "rough surfaces of Lambertian facets", "10.1145/192161.192213",
    ),
    Citation(
        "cook1982", "article", ("Robert L. Cook", "Kenneth E. Torrance"),
        "A Reflectance Model for Computer Graphics", _TOG, "1(1), 7–24", 1982,
        "rough mirrors", "10.1145/357290.357293",
    ),
    Citation(
        "deon2023", "inproceedings", ("Eugene d'Eon",),
        "Student-T and Beyond: Practical Tools for Multiple-Scattering BSDFs with General NDFs",
        "ACM SIGGRAPH Talks", "", 2023, "γ and σ of ground and etched glass",
    ),
    Citation(
        "johnson1972", "article", ("P. B. Johnson", "R. W. Christy"),
        "Optical Constants of the Noble Metals", "Physical Review B", "6(12), 4370–4379", 1972,
        "index of gold or copper", "10.1103/PhysRevB.6.4370",
    ),
    Citation(
        "rakic1995", "article", ("Aleksandar D. Rakić",),
        "Algorithm for the determination of intrinsic optical constants of metal films: "
        "application to aluminum",
        "Applied Optics", "34(22), 4755–4767", 1995, "index of aluminium", "10.1364/AO.34.004755",
    ),
    Citation(
        "white1982", "article", ("Halbert White",),
        "Maximum Likelihood Estimation of Misspecified Models", "Econometrica", "50(1), 1–25",
        1982, "intervals of a fit to correlated facets", "10.2307/1912526",
    ),
    Citation(
        "iso25178", "misc", ("International Organization for Standardization",),
        "ISO 25178-2:2021, Geometrical product specifications: surface texture: areal. Part 2: "
        "Terms, definitions and surface texture parameters",
        "standard", "", 2021, "Sq, Sa, Sdq and Sdr",
    ),
    Citation(
        "tukey1951", "article", ("John W. Tukey",), "Components in regression", "Biometrics",
        "7(1), 33–69", 1951, "interval of what lies between surfaces",
    ),
    Citation(
        "williams1962", "article", ("J. S. Williams",),
        "A confidence interval for variance components", "Biometrika", "49, 278–281", 1962,
        "interval of what lies between surfaces",
    ),
    Citation(
        "satterthwaite1946", "article", ("F. E. Satterthwaite",),
        "An Approximate Distribution of Estimates of Variance Components", "Biometrics Bulletin",
        "2(6), 110–114", 1946, "degrees of freedom of the rays' errors", "10.2307/3002019",
    ),
    Citation(
        "harris2020", "article", ("Charles R. Harris and others",),
        "Array programming with NumPy", "Nature", "585, 357–362", 2020, "arrays",
        "10.1038/s41586-020-2649-2",
    ),
    Citation(
        "virtanen2020", "article", ("Pauli Virtanen and others",),
        "SciPy 1.0: fundamental algorithms for scientific computing in Python", "Nature Methods",
        "17, 261–272", 2020, "special functions, statistics", "10.1038/s41592-019-0686-2",
    ),
    Citation(
        "hoyer2017", "article", ("Stephan Hoyer", "Joe Hamman"),
        "xarray: N-D labeled Arrays and Datasets in Python",
        "Journal of Open Research Software", "5(1), 10", 2017, "labelled results",
        "10.5334/jors.148",
    ),
    Citation(
        "lam2015", "inproceedings", ("Siu Kwan Lam", "Antoine Pitrou", "Stanley Seibert"),
        "Numba: a LLVM-based Python JIT compiler",
        "Second Workshop on the LLVM Compiler Infrastructure in HPC", "", 2015,
        "compiled loops", "10.1145/2833157.2833162",
    ),
    Citation(
        "hunter2007", "article", ("John D. Hunter",), "Matplotlib: A 2D Graphics Environment",
        "Computing in Science & Engineering", "9(3), 90–95", 2007, "figures",
        "10.1109/MCSE.2007.55",
    ),
)  # fmt: skip
BY_KEY = {reference.key: reference for reference in REFERENCES}
