"use strict";
// Order 1 of interfaced-Lambertian facets in the plane of incidence, as `microsurf predict` has it
// (microsurf/model/single_scattering). Angles here are in degrees, BRDFs in 1/sr without the cosine.
// A detector's angle is positive on the mirror side. Slopes are (p, q), p along the plane.

const theory = (() => {
  // Gauss and Legendre's six nodes on [-1, 1].
  const NODES = [
    [-0.932469514203152, 0.171324492379170], [-0.661209386466265, 0.360761573048139],
    [-0.238619186083197, 0.467913934572691], [0.238619186083197, 0.467913934572691],
    [0.661209386466265, 0.360761573048139], [0.932469514203152, 0.171324492379170],
  ];
  const STRETCH = 4; // of the map below: e-foldings of even spacing before it widens
  const NEGLECTED = 16; // −ln of the part of an integral that may be left out
  const radians = (degrees) => (degrees * Math.PI) / 180;

  // ∫ f over [low, high]. x = core sinh(L sinh(t/L)) spaces nodes evenly in x near 0, in ln x
  // beyond, and ever wider further out: heavy tails end after a dozen panels.
  function integral(f, low, high, core) {
    const t = (x) => STRETCH * Math.asinh(Math.asinh(x / core) / STRETCH);
    const first = t(low), length = t(high) - first;
    if (!(length > 0)) return 0;
    const panels = Math.ceil(length), half = length / panels / 2;
    let sum = 0;
    for (let k = 0; k < panels; k++) {
      for (const [node, weight] of NODES) {
        const u = (first + half * (2 * k + 1 + node)) / STRETCH;
        const v = STRETCH * Math.sinh(u);
        sum += weight * f(core * Math.sinh(v)) * core * Math.cosh(v) * Math.cosh(u);
      }
    }
    return sum * half;
  }

  // ln Γ(x), x > 0, by Lanczos.
  function logGamma(x) {
    const c = [
      676.5203681218851, -1259.1392167224028, 771.32342877765313, -176.61502916214059,
      12.507343278686905, -0.13857109526572012, 9.9843695780195716e-6, 1.5056327351493116e-7,
    ];
    const base = x + 6.5;
    const series = c.reduce((sum, term, k) => sum + term / (x + k), 0.99999999999980993);
    return 0.5 * Math.log(2 * Math.PI) + (x - 0.5) * Math.log(base) - base + Math.log(series);
  }

  // Fresnel's reflectance and transmittance of a dielectric, μ the cosine of incidence in air.
  function transmittance(mu, n) {
    if (n === 1) return 1;
    const g = Math.sqrt((n - 1) * (n + 1) + mu * mu);
    return 2 * g * mu * (1 / (g + mu) ** 2 + (n / (n * n * mu + g)) ** 2);
  }
  function reflectance(mu, n) {
    if (n === 1) return 0;
    const excess = (n - 1) * (n + 1), g = Math.sqrt(excess + mu * mu);
    const s = excess / (g + mu) ** 2;
    const p = (excess * ((n * n + 1) * mu * mu - 1)) / (n * n * mu + g) ** 2;
    return (s * s + p * p) / 2;
  }

  // 1 − r_e: the part of diffuse light that enters.
  function diffuseTransmittance(n) {
    if (n === 1) return 1;
    return integral((mu) => 2 * mu * transmittance(mu, n), 0, 1, Math.sqrt(n * n - 1) / 4);
  }

  // What one body event leaves of light: Kd (1 − r_i)/(1 − Kd r_i).
  function bodyWeight(n, kd) {
    const out = diffuseTransmittance(n) / (n * n); // 1 − r_i
    return (kd * out) / (1 - kd * (1 - out));
  }

  // Density of slopes at p² + q² = rho2: Student's t (Ribardière et al. 2017).
  function slopeDensity(rho2, gamma, sigma) {
    const s2 = sigma * sigma;
    return Math.exp(-gamma * Math.log1p(rho2 / ((gamma - 1) * s2))) / (Math.PI * s2);
  }

  // Smith's Λ = (1/x) ∫ u t_ν(x + u) du over u > 0, x = √2 cotθ/σ and ν = 2γ − 2.
  function smithLambda(theta, gamma, sigma) {
    const tangent = Math.abs(Math.tan(radians(theta)));
    if (tangent < 1e-12) return 0;
    const x = Math.SQRT2 / (tangent * sigma), nu = 2 * gamma - 2;
    const height = Math.exp(logGamma((nu + 1) / 2) - logGamma(nu / 2)) / Math.sqrt(nu * Math.PI);
    const density = (y) => height * Math.exp((-(nu + 1) / 2) * Math.log1p((y * y) / nu));
    const end = Math.sqrt((nu + x * x) * Math.exp((2 * NEGLECTED) / (nu - 1)) - nu) - x;
    const core = 1 / Math.max(1, ((nu + 1) * x) / (nu + x * x));
    return integral((u) => u * density(x + u), 0, end, core) / x;
  }

  // G2 of both directions alone; that of V-cavities depends on the facet.
  const MASKINGS = {
    "smith": (i, o) => 1 / (1 + i + o),
    "smith-separable": (i, o) => 1 / ((1 + i) * (1 + o)),
    "vcavity": () => 1,
  };

  // Mirrored light at a detector's angle θ_o and φ degrees beside the plane, 0 in it.
  function specular(of, thetaO, beside) {
    const i = radians(of.theta), o = radians(thetaO), phi = radians(beside);
    const x = Math.sin(i) - Math.sin(o) * Math.cos(phi), y = Math.sin(o) * Math.sin(phi);
    const z = Math.cos(i) + Math.cos(o), length = Math.hypot(x, y, z);
    const up = z / length, facing = length / 2;
    let masking = of.masking(of.lambdaI, of.lambda(thetaO));
    if (of.vcavity) {
      masking = Math.min(1, (2 * up * Math.min(Math.cos(i), Math.cos(o))) / facing);
    }
    const normals = slopeDensity((x * x + y * y) / (z * z), of.gamma, of.sigma) / up ** 4;
    return (reflectance(facing, of.n) * normals * masking) / (4 * Math.cos(i) * Math.cos(o));
  }

  // Its mean over a bin of the detector, weighted by the cosine: rings of 2°, the cap and the last
  // of 1°, and sectors of 10°; the cap is all around.
  function specularInBin(of, thetaO) {
    const ring = Math.abs(thetaO), side = thetaO < 0 ? -1 : 1;
    const [low, high] = ring === 0 ? [0, 1] : ring > 89 ? [89, 90] : [ring - 1, ring + 1];
    const half = ring === 0 ? 180 : 5;
    let sum = 0, whole = 0;
    for (const [node, weight] of NODES) {
      const theta = (low + high + node * (high - low)) / 2;
      const share = weight * Math.sin(radians(2 * theta));
      for (const [other, part] of NODES) {
        sum += share * part * specular(of, side * theta, (half * (1 + other)) / 2);
        whole += share * part;
      }
    }
    return sum / whole;
  }

  // f_b = w/(π (1 − r_e)) G2 ∫∫ X_i X_o g T(i·m) T(o·m) P(p, q) dp dq, where X_w = w·(−p, 0, 1)/w_z,
  // g = 1/√(1 + p² + q²), and w·m = w_z X_w g. In the plane X depends on p alone.
  function body(of, thetaO) {
    if (of.kd === 0) return 0;
    const { gamma, sigma, n } = of;
    const a = Math.tan(radians(of.theta)), b = Math.tan(radians(thetaO));
    const cosI = Math.cos(radians(of.theta)), cosO = Math.cos(radians(thetaO));
    const s2 = (gamma - 1) * sigma * sigma;
    const far = Math.sqrt(s2 * Math.expm1(NEGLECTED / (gamma - 1.5)));

    function across(p, xI, xO) {
      const width2 = s2 + p * p;
      const core = Math.min(Math.sqrt(width2 / gamma), Math.sqrt(1 + p * p));
      const end = Math.sqrt(width2 * Math.expm1(NEGLECTED / (gamma - 0.5)));
      const inside = (q) => {
        const g = 1 / Math.sqrt(1 + p * p + q * q);
        return (
          g * slopeDensity(p * p + q * q, gamma, sigma) *
          transmittance(cosI * xI * g, n) * transmittance(cosO * xO * g, n)
        );
      };
      return 2 * integral(inside, 0, end, core);
    }
    function along(p) {
      const xI = 1 - p * a, xO = 1 + p * b;
      const masking = of.vcavity ? 2 / Math.max(2, xI, xO) : 1;
      return masking * xI * xO * across(p, xI, xO);
    }

    // Where a facet turns away from i or o the domain ends; where X = 2 a V-cavity begins to hide.
    const low = Math.max(-far, b > 0 ? -1 / b : -far);
    const high = Math.min(far, a > 0 ? 1 / a : far, b < 0 ? -1 / b : far);
    const inner = [0, a > 0 ? -1 / a : 0, b !== 0 ? 1 / b : 0].filter((p) => low < p && p < high);
    const cuts = [low, ...inner.sort((x, y) => x - y), high];
    const core = Math.min(1, sigma * Math.min(1, Math.sqrt(gamma - 1)));
    let sum = 0;
    for (let k = 1; k < cuts.length; k++) sum += integral(along, cuts[k - 1], cuts[k], core);
    const masking = of.masking(of.lambdaI, of.lambda(thetaO));
    return (of.weight * masking * sum) / (Math.PI * of.entering);
  }

  // What all directions share; Λ is kept for those that come again.
  function prepared(settings) {
    const known = new Map();
    const lambda = (theta) => {
      const key = Math.abs(theta);
      if (!known.has(key)) known.set(key, smithLambda(key, settings.gamma, settings.sigma));
      return known.get(key);
    };
    return {
      ...settings,
      masking: MASKINGS[settings.masking],
      vcavity: settings.masking === "vcavity",
      lambda,
      lambdaI: lambda(settings.theta),
      entering: diffuseTransmittance(settings.n),
      weight: bodyWeight(settings.n, settings.kd),
    };
  }

  function lobesOf(angles, of, mirror) {
    const specular = angles.map((o) => mirror(of, o)), through = angles.map((o) => body(of, o));
    return { specular, body: through, total: specular.map((v, k) => v + through[k]) };
  }

  // Lobes at angles: {specular, body, total}, a list each.
  function lobes(settings, angles) {
    return lobesOf(angles, prepared(settings), (of, o) => specular(of, o, 0));
  }

  // Means over the detector's bins at their middles. The body's lobe is smooth: its value there.
  function lobesInBins(settings, angles) {
    return lobesOf(angles, prepared(settings), specularInBin);
  }

  return { lobes, lobesInBins, bodyWeight };
})();
