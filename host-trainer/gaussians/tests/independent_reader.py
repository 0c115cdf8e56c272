"""Reads .ply, .spz, .sog and .glb by their published descriptions, with Python alone (and dwebp for the images of .sog).

It shares nothing with the crate it judges. Prints one JSON object: `compensation`, `degree`, and for each Gaussian centre, deviations,
rotation (w, x, y, z), opacity, and harmonics by coefficient, RGB each; axes x right, y down, z forward.
"""

import gzip
import json
import math
import os
import struct
import subprocess
import sys
import tempfile
import zipfile


def sigmoid(x):
    return 1 / (1 + math.exp(-x))


def read_ply(data):
    header, body = data.split(b"end_header\n", 1)
    lines = header.decode().splitlines()
    assert lines[0] == "ply" and "format binary_little_endian 1.0" in lines
    names = [line.split()[2] for line in lines if line.startswith("property float ")]
    count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex "))
    assert len(body) == 4 * len(names) * count
    n_rest = sum(name.startswith("f_rest_") for name in names) // 3
    gaussians = []
    for row in struct.iter_unpack("<%df" % len(names), body):
        value = dict(zip(names, row))
        gaussians.append({
            "centre": [value[axis] for axis in "xyz"],
            "deviations": [math.exp(value["scale_%d" % i]) for i in range(3)],
            "rotation": [value["rot_%d" % i] for i in range(4)],
            "opacity": sigmoid(value["opacity"]),
            "harmonics": [[value["f_dc_%d" % c] for c in range(3)]]
            + [[value["f_rest_%d" % (c * n_rest + i)] for c in range(3)] for i in range(n_rest)],
        })
    return "comment SplatRenderMode: mip" in lines, math.isqrt(n_rest + 1) - 1, gaussians


def read_spz(data):
    data = gzip.decompress(data)
    magic, version, count, degree, fraction_bits, flags, _ = struct.unpack_from("<IIIBBBB", data)
    assert magic == 0x5053474E and version == 3
    n_rest = (degree + 1) ** 2 - 1
    at = 16

    def take(n_bytes):
        nonlocal at
        rows = [data[at + n_bytes * i:at + n_bytes * (i + 1)] for i in range(count)]
        at += n_bytes * count
        return rows

    centres = [[int.from_bytes(row[3 * i:3 * i + 3], "little", signed=True) / 2**fraction_bits for i in range(3)] for row in take(9)]
    opacities = [row[0] / 255 for row in take(1)]
    colours = [[(byte / 255 - 0.5) / 0.15 for byte in row] for row in take(3)]
    deviations = [[math.exp(byte / 16 - 10) for byte in row] for row in take(3)]
    rotations = []
    for row in take(4):
        packed = int.from_bytes(row, "little")
        largest, parts = packed >> 30, [0.0] * 4
        for index in (3, 2, 1, 0):
            if index != largest:
                parts[index] = (packed & 511) / 511 / math.sqrt(2) * (-1 if packed & 512 else 1)
                packed >>= 10
        parts[largest] = math.sqrt(max(0, 1 - sum(part * part for part in parts)))
        rotations.append([parts[3], parts[0], parts[1], parts[2]])
    rest = [[[(byte - 128) / 128 for byte in row[3 * i:3 * i + 3]] for i in range(n_rest)] for row in take(3 * n_rest)]
    # Records of vendors end the file: type, length, content. Adobe's of the axes says RUB.
    assert flags & 2
    kind, length, axes = struct.unpack_from("<III", data, at)
    assert (kind, length, axes) == (0xADBE0003, 4, 4) and at + 12 == len(data)
    # From y up and z back: a function that is odd in (y, z) changes its sign. Tried out on the functions themselves.
    here, there = real_harmonics(0.3, 0.5, 0.8), real_harmonics(0.3, -0.5, -0.8)
    signs = [round(b / a) for a, b in zip(here, there)]
    gaussians = []
    for i in range(count):
        (x, y, z), (w, qx, qy, qz) = centres[i], rotations[i]
        gaussians.append({
            "centre": [x, -y, -z],
            "deviations": deviations[i],
            "rotation": [w, qx, -qy, -qz],
            "opacity": opacities[i],
            "harmonics": [colours[i]] + [[sign * c for c in rgb] for sign, rgb in zip(signs, rest[i])],
        })
    return bool(flags & 1), degree, gaussians


def real_harmonics(x, y, z):
    """Degree 1 to 3 without their factors."""
    return [y, z, x, x * y, y * z, 2 * z * z - x * x - y * y, x * z, x * x - y * y, y * (3 * x * x - y * y), x * y * z,
            y * (4 * z * z - x * x - y * y), z * (2 * z * z - 3 * x * x - 3 * y * y), x * (4 * z * z - x * x - y * y),
            z * (x * x - y * y), x * (x * x - 3 * y * y)]


def pixels_of(webp):
    """Width and RGBA pixels, by libwebp."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "image.webp")
        with open(path, "wb") as file:
            file.write(webp)
        pam = subprocess.run(["dwebp", "-quiet", "-pam", path, "-o", "-"], check=True, capture_output=True).stdout
    header, body = pam.split(b"ENDHDR\n", 1)
    fields = dict(line.split(None, 1) for line in header.decode().splitlines()[1:])
    assert fields["DEPTH"].strip() == "4" and len(body) == 4 * int(fields["WIDTH"]) * int(fields["HEIGHT"])
    return int(fields["WIDTH"]), [body[i:i + 4] for i in range(0, len(body), 4)]


def read_sog(path):
    archive = zipfile.ZipFile(path)
    assert archive.testzip() is None
    meta = json.loads(archive.read("meta.json"))
    assert meta["version"] == 2
    image = {name: pixels_of(archive.read(name)) for key in ("means", "scales", "quats", "sh0", "shN") if key in meta
             for name in meta[key]["files"]}
    low, high = (image[name][1] for name in meta["means"]["files"])
    scales, quats, sh0 = (image[meta[key]["files"][0]][1] for key in ("scales", "quats", "sh0"))
    others = meta.get("shN")
    degree = others["bands"] if others else 0
    n_rest = (degree + 1) ** 2 - 1
    if others:
        (width, centroids), (_, labels) = (image[name] for name in others["files"])
        assert width == 64 * n_rest
    gaussians = []
    for i in range(meta["count"]):
        centre = []
        for axis in range(3):
            share = (high[i][axis] << 8 | low[i][axis]) / 65535
            value = meta["means"]["mins"][axis] * (1 - share) + meta["means"]["maxs"][axis] * share
            centre.append(math.copysign(math.exp(abs(value)) - 1, value))
        parts = [(byte / 255 - 0.5) * 2 / math.sqrt(2) for byte in quats[i][:3]]
        assert quats[i][3] >= 252
        parts.insert(quats[i][3] - 252, math.sqrt(max(0, 1 - sum(part * part for part in parts))))
        harmonics = [[meta["sh0"]["codebook"][byte] for byte in sh0[i][:3]]]
        if others:
            label = labels[i][0] + (labels[i][1] << 8)
            assert label < others["count"]
            for number in range(n_rest):
                pixel = centroids[label // 64 * width + label % 64 * n_rest + number]
                harmonics.append([others["codebook"][byte] for byte in pixel[:3]])
        gaussians.append({
            "centre": centre,
            "deviations": [math.exp(meta["scales"]["codebook"][byte]) for byte in scales[i][:3]],
            "rotation": parts,
            "opacity": sh0[i][3] / 255,
            "harmonics": harmonics,
        })
    return meta["antialias"], degree, gaussians


def read_glb(data):
    magic, version, length, json_bytes, kind = struct.unpack_from("<4sIII4s", data)
    assert (magic, version, length, kind) == (b"glTF", 2, len(data), b"JSON")
    gltf, binary = json.loads(data[20:20 + json_bytes]), data[28 + json_bytes:]
    assert gltf["asset"]["version"] == "2.0" and gltf["extensionsUsed"] == ["KHR_gaussian_splatting"]
    primitive = gltf["meshes"][gltf["nodes"][gltf["scenes"][gltf["scene"]]["nodes"][0]]["mesh"]]["primitives"][0]
    assert primitive["mode"] == 0 and primitive["extensions"]["KHR_gaussian_splatting"]["kernel"] == "ellipse"

    def rows(name):
        accessor = gltf["accessors"][primitive["attributes"][name]]
        view = gltf["bufferViews"][accessor["bufferView"]]
        form = "<%d%s" % ({"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]], {5126: "f", 5123: "H"}[accessor["componentType"]])
        found = list(struct.iter_unpack(form, binary[view["byteOffset"]:view["byteOffset"] + view["byteLength"]]))
        assert len(found) == accessor["count"]
        return found

    def of(name):
        return rows("KHR_gaussian_splatting:" + name)

    positions, rotations, scales, opacities, points = rows("POSITION"), of("ROTATION"), of("SCALE"), of("OPACITY"), rows("COLOR_0")
    bounds = gltf["accessors"][primitive["attributes"]["POSITION"]]
    assert [min(axis) for axis in zip(*positions)] == bounds["min"] and [max(axis) for axis in zip(*positions)] == bounds["max"]
    names = [(degree, number) for degree in range(4) for number in range(2 * degree + 1)]
    names = [name for name in names if "KHR_gaussian_splatting:SH_DEGREE_%d_COEF_%d" % name in primitive["attributes"]]
    coefficients = [of("SH_DEGREE_%d_COEF_%d" % name) for name in names]
    # From x left and y up: a function that is odd in (x, y) changes its sign. Tried out on the functions themselves.
    here, there = real_harmonics(0.3, 0.5, 0.8), real_harmonics(-0.3, -0.5, 0.8)
    signs = [1] + [round(b / a) for a, b in zip(here, there)]
    gaussians = []
    for i, ((x, y, z), (qx, qy, qz, w), point) in enumerate(zip(positions, rotations, points)):
        assert abs(math.hypot(qx, qy, qz, w) - 1) < 1e-6
        colour = [min(max(0.5 + 0.28209479 * c, 0), 1) for c in coefficients[0][i]]
        fallback = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in colour] + [opacities[i][0]]
        assert all(abs(65535 * value - share) <= 0.6 for value, share in zip(fallback, point))
        gaussians.append({
            "centre": [-x, -y, z],
            "deviations": list(scales[i]),
            "rotation": [w, -qx, -qy, qz],
            "opacity": opacities[i][0],
            "harmonics": [[sign * c for c in rows[i]] for sign, rows in zip(signs, coefficients)],
        })
    return gltf["asset"].get("extras", {}).get("antialias", False), names[-1][0], gaussians


def main(path):
    with open(path, "rb") as file:
        data = file.read()
    read = {".ply": lambda: read_ply(data), ".spz": lambda: read_spz(data), ".sog": lambda: read_sog(path), ".glb": lambda: read_glb(data)}
    compensation, degree, gaussians = read[os.path.splitext(path)[1]]()
    json.dump({"compensation": compensation, "degree": degree, "gaussians": gaussians}, sys.stdout)


main(sys.argv[1])
