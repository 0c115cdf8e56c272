"""Training, as a process of its own."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ._bundle import Bundle

_POLL_S = 0.2
# Of what a run said that ended without an error of its own.
_LAST_LINES = 3


class TrainError(RuntimeError):
    """Training failed; the message is the command's own."""


@dataclass(frozen=True)
class Progress:
    """One row of the run's progress.csv."""

    iteration: int
    loss: float
    psnr_db: float
    """Mean over the training views since the row before, as `loss` is; both are nan where each of those steps was dropped."""
    n_anchors: int
    seconds: float
    """Time spent on iterations so far."""


class Training:
    """A run that goes on in another process. Iterate over it for its progress; `bundle()` waits for its end.

    Left early, by an interrupt too, it goes on by itself; `stop()` ends it with a checkpoint, from which
    `pocketsplat train --resume` goes on.
    """

    def __init__(self, command: list[str], output: Path, run: Path) -> None:
        self.output: Path = output
        """The bundle, once it is there."""
        self.run: Path = run
        """The folder of the run: report.html, result.json, checkpoints."""
        # What lies in the folder of an earlier run is no progress of this one.
        self._started = time.time()
        self._error = ""
        self._warnings: list[str] = []
        self._said = tempfile.TemporaryFile(mode="w+", encoding="utf-8", errors="replace")
        # The package is found there as it is here.
        packages = [str(Path(__file__).parent.parent), os.environ.get("PYTHONPATH", "")]
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, packages))}
        # In a session of its own, so that Ctrl-C and a notebook's interrupt stop what waits for it and not the run.
        self._process = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=self._said, env=environment, start_new_session=True
        )

    def __iter__(self) -> Iterator[Progress]:
        """Yields a row each time the run writes one, until it ends.

        Raises TrainError where it fails.
        """
        n_seen = 0
        while True:
            # Asked before the rows are read, so that the last ones are not missed.
            has_ended = self._process.poll() is not None
            rows = self._rows()
            yield from rows[n_seen:]
            n_seen = max(n_seen, len(rows))
            if has_ended:
                self._check()
                return
            time.sleep(_POLL_S)

    def wait(self) -> dict[str, Any]:
        """Waits for the end and gives the content of result.json: psnr_db, ssim, bundle_bytes, views and so on.

        What the command warned of is warned of at its end, here, in `bundle()` and where one iterates. Raises TrainError where the run fails.
        """
        self._process.wait()
        self._check()
        result: dict[str, Any] = json.loads((self.run / "result.json").read_text(encoding="utf-8"))
        return result

    def bundle(self) -> Bundle:
        """Waits for the end and opens the bundle.

        Raises TrainError where the run fails.
        """
        self._process.wait()
        self._check()
        return Bundle.open(self.output)

    def stop(self) -> None:
        """Ends the run with a checkpoint, and waits for that; one that has not begun to train is let begin."""
        while self._process.poll() is None and not self._rows():
            time.sleep(_POLL_S)
        # Not SIGINT, which all ignore that a shell started in the background, such as the server of a notebook.
        self._process.send_signal(signal.SIGTERM)
        self._process.wait()

    def _rows(self) -> list[Progress]:
        path = self.run / "progress.csv"
        try:
            if path.stat().st_mtime < self._started:
                return []
            text = path.read_text(encoding="utf-8")
        except OSError:
            return []
        # The last line may be half written.
        lines = text[: text.rfind("\n") + 1].splitlines()
        return [
            Progress(
                iteration=int(row["iteration"]),
                loss=float(row["loss"] or "nan"),
                psnr_db=float(row["psnr_db"] or "nan"),
                n_anchors=int(row["anchors"]),
                seconds=float(row["seconds"]),
            )
            for row in csv.DictReader(lines)
        ]

    def _check(self) -> None:
        if not self._said.closed:
            self._said.seek(0)
            said = self._said.read().strip()
            self._said.close()
            # At the beginning of a line: a warning may hold the word.
            at = 0 if said.startswith("error: ") else said.find("\nerror: ") + 1 or -1
            # Killed, it had no time to say why: the last of its progress tells how far it came.
            last = "\n".join(said.splitlines()[-_LAST_LINES:])
            self._error = said[at:] if at >= 0 else f"training {_end_of(self._process.returncode)}\n{last}".strip()
            self._warnings = [line for line in said.splitlines() if line.startswith("warning: ")]
        code = self._process.returncode
        if code != 0:
            raise TrainError(self._error)
        while self._warnings:
            warnings.warn(self._warnings.pop(0).removeprefix("warning: "), stacklevel=3)


def _run_beside(output: Path) -> Path:
    """OUT.run for a bundle, OUT.ply.run for another file."""
    return output.with_suffix(".run") if output.suffix.lower() in ("", ".psb") else output.with_name(output.name + ".run")


def _end_of(code: int) -> str:
    return f"was ended by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"


def train(capture: str | os.PathLike[str], output: str | os.PathLike[str], **options: Any) -> Training:
    """Trains a scene from a folder of photographs with poses, in a process of its own.

        training = pocketsplat.train("capture", "scene.psb", preset="quick", lambda_=0.004)
        for progress in training:
            print(progress.iteration, progress.psnr_db)
        bundle = training.bundle()

    Options are those of `pocketsplat train`, with underscores: `max_resolution=400` is `--max-resolution 400`, `overwrite=True` is
    `--overwrite`, lists are joined by commas, but that of `set_` is several `--set`. An underscore at the end keeps words of Python
    apart: `lambda_`.

    Raises ValueError for `dry_run`, `help` and `version`, which train nothing, and for `watch=True`, whose address nobody would see.
    """
    for name, value in options.items():
        option = name.rstrip("_").replace("_", "-")
        if value and option in ("dry-run", "help", "version"):
            raise ValueError(f"{name} trains nothing; give it to the command: `python -m pocketsplat train CAPTURE --{option}`")
    if options.get("watch") is True:
        raise ValueError("watch=True takes a port that nobody is told; give one: watch=8080")
    # By its path: `-m pocketsplat` would look into the working folder first.
    program = Path(__file__).with_name("__main__.py")
    command = [sys.executable, str(program), "train", os.fspath(capture), "-o", os.fspath(output)]
    for name, value in options.items():
        option = "--" + name.rstrip("_").replace("_", "-")
        if value is True:
            command.append(option)
        elif value is not False and value is not None:
            values = [str(one) for one in value] if isinstance(value, (list, tuple)) else [str(value)]
            # `=` keeps values that begin with a hyphen apart from options.
            command += [f"{option}={one}" for one in (values if option == "--set" else [",".join(values)])]
    bundle = Path(output).absolute()
    given = options.get("run") or options.get("resume")
    run = Path(given).absolute() if given else _run_beside(bundle)
    return Training(command, bundle, run)
