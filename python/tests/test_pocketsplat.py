"""Of the installed package: `python -m unittest discover python/tests` with REPOSITORY set to the repository."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import unittest
import zlib
from pathlib import Path

import numpy
import pocketsplat
from pocketsplat import Bundle, Camera

REPOSITORY = Path(os.environ["REPOSITORY"])
GOLDEN = REPOSITORY / "tests/golden"
COMMAND = Path(sys.executable).with_name("pocketsplat")


def psnr_db(a: numpy.ndarray, b: numpy.ndarray) -> float:
    return float(-10 * numpy.log10(numpy.mean((a.astype(float) - b.astype(float)) ** 2) / 255**2))


def splatted(bundle: Bundle, camera: Camera) -> numpy.ndarray:
    """The Gaussians as gsplat draws them (Kerbl et al. 2023), written from the paper."""
    gaussians = bundle.gaussians(camera)
    rotation, translation = camera.viewmat[:3, :3].astype(float), camera.viewmat[:3, 3].astype(float)
    points = gaussians["means"] @ rotation.T + translation
    (fx, fy), (cx, cy) = camera.focal_px, camera.principal_px
    v, u = numpy.mgrid[0 : camera.height_px, 0 : camera.width_px] + 0.5
    picture = numpy.zeros((camera.height_px, camera.width_px, 3))
    light = numpy.ones((camera.height_px, camera.width_px))
    for i in numpy.argsort(points[:, 2]):
        x, y, z = points[i]
        w, a, b, c = gaussians["quats"][i].astype(float)
        axes = numpy.array([
            [1 - 2 * (b * b + c * c), 2 * (a * b - w * c), 2 * (a * c + w * b)],
            [2 * (a * b + w * c), 1 - 2 * (a * a + c * c), 2 * (b * c - w * a)],
            [2 * (a * c - w * b), 2 * (b * c + w * a), 1 - 2 * (a * a + b * b)],
        ]) * gaussians["scales"][i]
        jacobian = numpy.array([[fx / z, 0, -fx * x / z**2], [0, fy / z, -fy * y / z**2]]) @ rotation @ axes
        thin = jacobian @ jacobian.T
        wide = thin + 0.3 * numpy.eye(2)
        opacity = float(gaussians["opacities"][i])
        if bundle.header.dilation_compensation:
            opacity *= numpy.sqrt(max(numpy.linalg.det(thin), 0) / numpy.linalg.det(wide))
        du, dv = u - (fx * x / z + cx), v - (fy * y / z + cy)
        inverse = numpy.linalg.inv(wide)
        power = inverse[0, 0] * du**2 + 2 * inverse[0, 1] * du * dv + inverse[1, 1] * dv**2
        alpha = numpy.minimum(opacity * numpy.exp(-0.5 * power), 0.99)
        alpha[alpha < 1 / 255] = 0
        picture += (light * alpha)[..., None] * gaussians["colors"][i]
        light *= 1 - alpha
    picture += light[..., None] * (numpy.array(bundle.header.background) / 255)
    return numpy.round(255 * picture.clip(0, 1)).astype(numpy.uint8)


class Bundles(unittest.TestCase):
    def test_a_frame_is_the_golden_one(self) -> None:
        rows = [row.split(",") for row in (GOLDEN / "frames.csv").read_text().splitlines()[1:]]
        seen = 0
        for name, tiers, view, checksum in (row for row in rows if row[2] == "0"):
            bundle = Bundle.open(GOLDEN / f"{name}.psb")
            picture = bundle.render(tiers=int(tiers))
            self.assertEqual(f"{zlib.crc32(picture.tobytes()):08x}", checksum, (name, tiers, view))
            seen += 1
        self.assertGreater(seen, 3)

    def test_pixels_are_those_of_the_command(self) -> None:
        bundle = Bundle.open(GOLDEN / "context.psb")
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder, "turn")
            subprocess.run([COMMAND, "render", GOLDEN / "context.psb", "--orbit", "3", "-o", out], check=True, capture_output=True)
            step = 2 * numpy.float32(numpy.pi) / 3
            pictures = bundle.render([bundle.preview.orbited(float(i * step)) for i in range(3)])
            for picture, path in zip(pictures, sorted(out.iterdir()), strict=True):
                found = subprocess.run(
                    [sys.executable, "-c", READ_PNG, path], check=True, capture_output=True
                ).stdout
                self.assertEqual(found, picture.tobytes(), path)

    def test_gaussians_drawn_by_the_paper_are_the_picture(self) -> None:
        for name in ["static", "context", "isotropic", "matte"]:
            bundle = Bundle.open(GOLDEN / f"{name}.psb")
            camera = bundle.preview.orbited(0.7)
            self.assertGreater(psnr_db(bundle.render(camera), splatted(bundle, camera)), 45, name)

    def test_memory_is_a_knob_and_its_end_has_a_number(self) -> None:
        bundle = Bundle.open(GOLDEN / "static.psb")
        whole, sizes = bundle.plan(), [tier.n_anchors for tier in bundle.tiers]
        self.assertEqual((whole.n_tiers, sizes), (2, sorted(sizes)))
        with self.assertRaises(pocketsplat.BudgetError) as raised:
            bundle.plan(1000)
        least = bundle.plan(raised.exception.args[1])
        self.assertEqual((least.n_tiers, least.scratch_bytes), (1, raised.exception.args[1]))
        few = bundle.render(ram=least.scratch_bytes)
        self.assertTrue((few == bundle.render(tiers=1)).all())
        self.assertFalse((few == bundle.render()).all())
        with self.assertRaises(pocketsplat.BudgetError):
            bundle.render(ram=least.scratch_bytes - 1)
        with self.assertRaisesRegex(ValueError, 'quality "fast"'):
            bundle.render(quality="fast")  # type: ignore[arg-type]

    def test_a_tier_is_a_bundle_of_its_own(self) -> None:
        data = (GOLDEN / "static.psb").read_bytes()
        tier = Bundle(data).tiers[0]
        cut = Bundle(data[: tier.n_bytes])
        self.assertEqual(cut.header.n_bytes, tier.n_bytes)
        self.assertTrue((cut.render() == Bundle(data).render(tiers=1)).all())

    def test_what_is_no_bundle_or_damaged_is_said(self) -> None:
        data = bytearray((GOLDEN / "static.psb").read_bytes())
        data[-40] ^= 1
        with self.assertRaisesRegex(pocketsplat.BundleError, "chunk 5 is damaged: CRC"):
            Bundle(bytes(data))
        with self.assertRaisesRegex(pocketsplat.BundleError, "README.md: not a bundle"):
            Bundle.open(REPOSITORY / "README.md")
        with self.assertRaises(FileNotFoundError):
            Bundle.open(REPOSITORY / "nothing.psb")

    def test_cameras_go_to_matrices_and_back(self) -> None:
        bundle = Bundle.open(GOLDEN / "static.psb")
        camera = bundle.preview.resized(80, 60)
        again = Camera.from_matrices(camera.viewmat, camera.K, 80, 60)
        self.assertEqual(bundle.render(camera).shape, (60, 80, 3))
        wide = bundle.preview.resized(160, 60)
        self.assertEqual(wide.focal_px, camera.focal_px, "not stretched")
        self.assertTrue((bundle.render(wide)[:, 40:120] == bundle.render(camera)).mean() > 0.99, "not cut")
        self.assertTrue((bundle.render(camera) == bundle.render(again)).all())
        centre, scale = numpy.array(bundle.header.normalisation_centre), bundle.header.normalisation_scale
        # The same camera in the frame of the capture: x = R·(c - centre)·scale + t, divided by scale.
        view = numpy.eye(4)
        view[:3, :3] = camera.rotation
        view[:3, 3] = numpy.array(camera.translation) / scale - view[:3, :3] @ centre
        posed = bundle.camera(view, camera.K, 80, 60)
        numpy.testing.assert_allclose(posed.viewmat, camera.viewmat, atol=1e-6)
        with self.assertRaisesRegex(ValueError, r"\(2, 2\)"):
            Camera.from_matrices(numpy.eye(2), camera.K, 80, 60)
        with self.assertRaisesRegex(ValueError, r"\(1, 4, 4\)"):
            bundle.camera(view[None], camera.K, 80, 60)
        with self.assertRaisesRegex(ValueError, "2 sizes"):
            bundle.render([camera, bundle.preview])
        sheared = Camera(((1, 1, 0), (0, 1, 0), (0, 0, 1)), (0, 0, 4), (100, 100), (40, 30), 80, 60)
        with self.assertRaises(pocketsplat.BundleError):
            bundle.render(sheared)

    def test_numbers_out_of_range_are_said(self) -> None:
        bundle = Bundle.open(GOLDEN / "static.psb")
        camera = bundle.preview
        with self.assertRaisesRegex(ValueError, "last row of viewmat is .* transpose it"):
            Camera.from_matrices(bundle.preview.viewmat.T, camera.K, 80, 60)
        with self.assertRaisesRegex(ValueError, "last row of K is .* transpose it"):
            Camera.from_matrices(camera.viewmat, camera.K.T, 80, 60)
        skewed = camera.K
        skewed[0, 1] = 2.0
        with self.assertRaisesRegex(ValueError, r"skew of \[2.0, 0.0\]"):
            Camera.from_matrices(camera.viewmat, skewed, 80, 60)
        for draw in (lambda: bundle.render(camera.resized(70000, 60)), lambda: bundle.gaussians(camera.resized(80, 0))):
            with self.assertRaisesRegex(pocketsplat.BundleError, r"is (70000|0); needed"):
                draw()
        for angle in (float("nan"), 1e6):
            with self.assertRaisesRegex(pocketsplat.BundleError, "at most 8192"):
                camera.orbited(angle)
        for limits in ({"ram": -1}, {"tiers": 256}, {"size": (-2, 60)}):
            with self.assertRaisesRegex(pocketsplat.BundleError, "needed: 0 to"):
                bundle.plan(**limits)

    def test_a_fork_does_not_wait_for_threads_that_it_has_not(self) -> None:
        bundle = Bundle.open(GOLDEN / "static.psb")
        bundle.render([bundle.preview] * 2)
        child = os.fork()
        if child == 0:
            try:
                bundle.render([bundle.preview] * 2)
            except RuntimeError:
                os._exit(0)
            os._exit(1)
        self.assertEqual(os.waitpid(child, 0)[1], 0)

    def test_a_notebook_gets_a_page_in_a_frame(self) -> None:
        shown = Bundle.open(GOLDEN / "static.psb")._repr_html_()
        self.assertTrue(shown.startswith('<iframe srcdoc="&lt;'), shown[:80])
        self.assertEqual(shown.count('"') % 2, 0)
        self.assertNotIn("<script", shown)


class TrainingRuns(unittest.TestCase):
    folder: tempfile.TemporaryDirectory[str]
    capture: Path

    @classmethod
    def setUpClass(cls) -> None:
        cls.folder = tempfile.TemporaryDirectory()
        cls.capture = Path(cls.folder.name, "capture")
        subprocess.run([COMMAND, "synth", cls.capture, "--size", "48"], check=True, stdout=subprocess.DEVNULL)

    @classmethod
    def tearDownClass(cls) -> None:
        cls.folder.cleanup()

    def test_a_run_reports_and_ends_in_a_bundle(self) -> None:
        training = pocketsplat.train(
            self.capture, Path(self.folder.name, "a.psb"), iterations=120, lambda_=0.004, no_report=True, tiers=[0.4, 0]
        )
        rows = list(training)
        self.assertEqual(rows[-1].iteration, 120)
        self.assertEqual([row.iteration for row in rows], sorted({row.iteration for row in rows}))
        self.assertGreater(rows[-1].psnr_db, rows[0].psnr_db)
        result, bundle = training.wait(), training.bundle()
        self.assertEqual(result["bundle_bytes"], bundle.header.n_bytes)
        self.assertEqual(len(bundle.tiers), 2)
        # Once more in the same place: the rows of the run before are not this one's.
        again = pocketsplat.train(self.capture, training.output, iterations=60, no_report=True)
        iterations = [row.iteration for row in again]
        self.assertEqual((iterations[-1], iterations), (60, sorted(set(iterations))))
        self.assertEqual(again.wait()["iterations"], 60)

    def test_a_run_may_lie_elsewhere(self) -> None:
        run = Path(self.folder.name, "notes")
        training = pocketsplat.train(self.capture, Path(self.folder.name, "e.psb"), iterations=60, no_report=True, run=run)
        self.assertEqual(list(training)[-1].iteration, 60)
        self.assertEqual((training.run, training.wait()["iterations"]), (run, 60))

    def test_a_run_that_cannot_begin_says_why(self) -> None:
        training = pocketsplat.train(Path(self.folder.name, "nothing"), Path(self.folder.name, "b.psb"))
        with self.assertRaisesRegex(pocketsplat.TrainError, r"(?s)error: .*nothing"):
            list(training)
        with self.assertRaisesRegex(pocketsplat.TrainError, "--no-such-option"):
            pocketsplat.train(self.capture, "c.psb", no_such_option=1).bundle()

    def test_what_trains_nothing_is_refused(self) -> None:
        for name in ("dry_run", "help"):
            with self.assertRaisesRegex(ValueError, "trains nothing"):
                pocketsplat.train(self.capture, "c.psb", **{name: True})

        with self.assertRaisesRegex(ValueError, "watch=8080"):
            pocketsplat.train(self.capture, "c.psb", watch=True)

    def test_steps_that_were_all_dropped_have_no_loss(self) -> None:
        training = pocketsplat.Training.__new__(pocketsplat.Training)
        training.run, training._started = Path(self.folder.name), 0.0
        (training.run / "progress.csv").write_text("iteration,loss,psnr_db,anchors,seconds\n1,,,9,0.5\n2,0.1,20,9,1\n")
        dropped, sound = training._rows()
        self.assertTrue(numpy.isnan([dropped.loss, dropped.psnr_db]).all())
        self.assertEqual((sound.iteration, sound.loss, sound.psnr_db), (2, 0.1, 20.0))

    def test_a_run_that_is_killed_says_so(self) -> None:
        training = pocketsplat.train(self.capture, Path(self.folder.name, "k.psb"), iterations=3000)
        next(iter(training))
        training._process.kill()
        with self.assertRaisesRegex(pocketsplat.TrainError, "was ended by SIGKILL"):
            training.wait()

    def test_warnings_and_several_keys_come_through(self) -> None:
        keys = ["train.shape.n_offsets=2", "train.shape.feature_dim=4"]
        training = pocketsplat.train(
            self.capture, Path(self.folder.name, "f.psb"), iterations=20, no_report=True, set_=keys, images="none"
        )
        with self.assertWarnsRegex(UserWarning, "--images has no effect"):
            training.wait()
        self.assertEqual(training.bundle().header.feature_dim, 4)

    def test_a_run_that_is_stopped_goes_on(self) -> None:
        output = Path(self.folder.name, "d.psb")
        # As under a server that a shell started in the background.
        before = signal.signal(signal.SIGINT, signal.SIG_IGN)
        self.addCleanup(signal.signal, signal.SIGINT, before)
        training = pocketsplat.train(self.capture, output, iterations=3000)
        next(iter(training))
        training.stop()
        self.assertFalse(output.exists())
        with self.assertRaises(pocketsplat.TrainError):
            training.wait()
        subprocess.run([COMMAND, "train", "--resume", training.run], check=True, capture_output=True)
        self.assertGreater(Bundle.open(output).header.n_anchors, 0)


class Command(unittest.TestCase):
    def run_command(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([COMMAND, *arguments], capture_output=True, text=True, check=False)

    def test_it_is_the_command(self) -> None:
        said = self.run_command("--version")
        self.assertEqual((said.returncode, said.stderr), (0, ""))
        self.assertIn(f"pocketsplat {pocketsplat.__version__} ", said.stdout)
        module = subprocess.run([sys.executable, "-m", "pocketsplat", "--version"], capture_output=True, text=True)
        self.assertEqual(module.stdout, said.stdout)

    def test_exit_codes_go_through(self) -> None:
        wrong = self.run_command("train")
        self.assertEqual(wrong.returncode, 2)
        self.assertIn("Usage: pocketsplat train ", wrong.stderr)
        self.assertEqual(self.run_command("inspect", "nothing.psb").returncode, 1)
        self.assertEqual(self.run_command("inspect", str(GOLDEN / "static.psb")).returncode, 0)


# Prints the pixels of a PNG of 8-bit RGB.
READ_PNG = """
import struct, sys, zlib
data = open(sys.argv[1], "rb").read()
at, parts = 8, b""
while at < len(data):
    length, kind = struct.unpack(">I4s", data[at : at + 8])
    body = data[at + 8 : at + 8 + length]
    if kind == b"IHDR":
        width, height, depth, colour = struct.unpack(">IIBB", body[:10])
        assert (depth, colour) == (8, 2)
    if kind == b"IDAT":
        parts += body
    at += 12 + length
raw, stride = zlib.decompress(parts), 3 * width
above = bytearray(stride)
for y in range(height):
    kind, line = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1 : (y + 1) * (stride + 1)])
    for i in range(stride):
        a, b, c = (line[i - 3] if i > 2 else 0), above[i], (above[i - 3] if i > 2 else 0)
        if kind == 4:
            p = a + b - c
            d = [abs(p - a), abs(p - b), abs(p - c)]
            guess = [a, b, c][d.index(min(d))]
        else:
            guess = [0, a, b, (a + b) // 2][kind]
        line[i] = (line[i] + guess) & 255
    above = line
    sys.stdout.buffer.write(line)
"""

if __name__ == "__main__":
    unittest.main()
