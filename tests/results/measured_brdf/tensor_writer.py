"""A writer of tensor files, for tests: made from the description of the format alone."""

import struct

import numpy as np

CODES = {"u1": 1, "f4": 10}


def write_tensors(path, fields):
    """Write arrays by name."""
    heads, body = [], b""
    start = 18 + sum(2 + len(n) + 2 + 1 + 8 + 8 * a.ndim for n, a in fields.items())
    for name, array in fields.items():
        code = CODES[array.dtype.str[1:]]
        heads.append(
            struct.pack("<H", len(name))
            + name.encode()
            + struct.pack("<HBQ", array.ndim, code, start + len(body))
            + struct.pack(f"<{array.ndim}Q", *array.shape)
        )
        body += array.tobytes()
    head = b"tensor_file\x00\x01\x00" + struct.pack("<I", len(fields)) + b"".join(heads)
    assert len(head) == start
    path.write_bytes(head + body)


def example(jacobian=1, spectral=False, isotropic=True):
    """Fields of a small material, smooth and arbitrary."""
    rng = np.random.default_rng(3)
    phi = np.array([0.0] if isotropic else [-np.pi, -2.0, -0.5, 1.0, np.pi], "f4")
    theta = np.radians([0.0, 20.0, 45.0, 70.0]).astype("f4")
    channels = 4 if spectral else 3
    fields = {
        "description": np.frombuffer(b"made up", "u1"),
        "phi_i": phi,
        "theta_i": theta,
        "ndf": (1 + rng.random((5, 6))).astype("f4"),
        "sigma": (0.5 + rng.random((5, 7))).astype("f4"),
        "vndf": (0.2 + rng.random((len(phi), 4, 6, 8))).astype("f4"),
        "luminance": np.ones((len(phi), 4, 9, 9), "f4"),
        ("spectra" if spectral else "rgb"): (
            0.1 + rng.random((len(phi), 4, channels, 9, 9))
        ).astype("f4"),
        "jacobian": np.array([jacobian], "u1"),
    }
    if isotropic:  # what a facet shows does not depend on the azimuth then
        fields["sigma"][:] = fields["sigma"][0]
    fields["vndf"][:, :, -1] = fields["vndf"][:, :, 0]
    if spectral:
        fields["wavelengths"] = np.array([450, 500, 550, 600], "f4")
    return fields
