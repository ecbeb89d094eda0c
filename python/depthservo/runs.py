"""Runs, replays, comparisons and sweeps: by name or file, and what they left on disk."""

from __future__ import annotations

import csv
import difflib
import io
import json
import os
import pathlib
from typing import Any, Dict, Iterable, List, Mapping, Optional, Union

import numpy as np

from . import _core

Path = Union[str, "os.PathLike[str]"]
Settings = Union[Mapping[str, Any], Iterable[str], None]


def _shipped_folders(kind: str) -> List[pathlib.Path]:
    """Within the package (a wheel, the build tree), or in share/depthservo of the prefix it is installed in."""
    package = pathlib.Path(__file__).resolve().parent
    here = pathlib.Path(_core.__file__).parent
    places = [here / "data" / kind, *(parent / "share" / "depthservo" / kind for parent in package.parents)]
    return [place for place in places if place.is_dir()]


def _shipped(kind: str) -> Dict[str, pathlib.Path]:
    files: Dict[str, pathlib.Path] = {}
    for folder in _shipped_folders(kind):
        for file in folder.rglob("*.yaml"):
            files.setdefault(file.relative_to(folder).with_suffix("").as_posix(), file)
    return files


def _file_of(name: Path, kind: str) -> str:
    """A path, or the name of a shipped file."""
    if pathlib.Path(name).is_file():
        return os.fspath(name)
    shipped = _shipped(kind)
    if str(name) in shipped:
        return str(shipped[str(name)])
    near = difflib.get_close_matches(str(name), shipped, 1)
    raise _core.InputError(f"{name}: there is no such file, nor a {kind[:-1]} of this name"
                           + (f"; did you mean '{near[0]}'?" if near else ""))


def _overrides(settings: Settings) -> List[str]:
    if settings is None:
        return []
    if isinstance(settings, Mapping):
        return [f"{key}={json.dumps(value)}" for key, value in settings.items()]
    if isinstance(settings, str):
        raise _core.InputError("set: expected a dict or a list of 'key=value', got a string")
    return list(settings)


def shipped_scenarios() -> List[str]:
    """Names that `run` takes."""
    return sorted(_shipped("scenarios"))


def run(scenario: Path, set: Settings = None, out: Optional[Path] = None) -> "_core.Run":
    """Servo a simulated robot to its goal.

    scenario: a file, or the name of a shipped one ("unicycle-4dots"). set: keys that replace those of the
    scenario, {"depth.initial": 8}. out: a run folder to write, which must not exist. Other threads may run
    meanwhile.
    """
    log = _core._run(_file_of(scenario, "scenarios"), _overrides(set))
    if out is not None:
        log.write(os.fspath(out))
    return log


def record(scenario: Path, folder: Path, set: Settings = None) -> "_core.Run":
    """Run a scenario and keep images, odometry and truth as a sequence in a new folder."""
    return _core._record(_file_of(scenario, "scenarios"), _overrides(set), os.fspath(folder))


def replay(sequence: Union["_core.Sequence", Path], out: Optional[Path] = None, **options: Any) -> "_core.Run":
    """Observe depth on recorded data: a Sequence, or the path of one; options as of `depthservo replay`."""
    if not isinstance(sequence, _core.Sequence):
        sequence = _core.Sequence(os.fspath(sequence))
    log = _core.replay(sequence, **options)
    if out is not None:
        log.write(os.fspath(out))
    return log


def compare(data: Union["_core.Sequence", Path], estimators: Iterable[str] = (), set: Settings = None) -> Dict[str, Any]:
    """Several estimators on the same measurements: of a scenario, or of a Sequence.

    Returns a dict: time (T,) [s]; estimators: name -> {error, sigma: (T,), rms over the points, relative to Z;
    coverage_2sigma; frames_to_5pct}; limits, likewise: the Cramer-Rao bound as error; verdict, a sentence.
    """
    if isinstance(data, _core.Sequence):
        return _core._compare_sequence(data, list(estimators))
    return _core._compare_scenario(_file_of(data, "scenarios"), _overrides(set), list(estimators))


def _columns(text: str) -> Dict[str, np.ndarray]:
    """A CSV as arrays by column: numbers where all cells are (an empty one is NaN), else words."""
    rows = list(csv.reader(io.StringIO(text)))
    header, cells = rows[0], rows[1:]
    columns = {}
    for i, name in enumerate(header):
        column = [row[i] for row in cells]
        try:
            columns[name] = np.array([float(cell) if cell else np.nan for cell in column])
        except ValueError:
            columns[name] = np.array(column)
    return columns


class RunFolder:
    """What `run`, `replay`, `live` or `servo` left in a folder."""

    def __init__(self, folder: Path):
        self.folder = pathlib.Path(folder)
        try:
            #: run.json: configuration, versions, outcome, metrics, events.
            self.info: Dict[str, Any] = json.loads((self.folder / "run.json").read_text())
            #: Columns of features.csv, an array each: one row per feature and frame.
            self.features = _columns((self.folder / "features.csv").read_text())
            #: Columns of frames.csv, an array each.
            self.frames = _columns((self.folder / "frames.csv").read_text())
        except (OSError, ValueError, IndexError) as error:
            raise _core.InputError(f"{self.folder}: not a run folder ({error})") from error
        self.features["id"] = self.features["id"].astype(int)
        self.features["measured"] = self.features["measured"].astype(bool)

    def to_pandas(self):
        """features.csv as a DataFrame, indexed by (id, timestamp)."""
        import pandas
        return pandas.DataFrame(self.features).set_index(["id", "timestamp"]).sort_index()


def read_run(folder: Path) -> RunFolder:
    """A run folder: `.features["Z"]`, `.frames["error_px"]`, `.info["outcome"]`, `.to_pandas()`."""
    return RunFolder(folder)


class SweepResults:
    """Runs of a sweep: `.columns` (an array for each axis and metric, one row per run) and `.info`."""

    def __init__(self, folder: Path):
        self.folder = pathlib.Path(folder)
        self.columns = _columns(_core._sweep_csv(os.fspath(folder)))
        #: Name, outcomes by number, claims.
        self.info: Dict[str, Any] = _core._sweep_json(os.fspath(folder))

    def to_pandas(self):
        """One row per run."""
        import pandas
        return pandas.DataFrame(self.columns).set_index("row")


def read_sweep(folder: Path) -> SweepResults:
    """The results in a folder of `depthservo sweep`, whole or not."""
    return SweepResults(folder)


def sweep(file: Path, out: Path, jobs: int = 0) -> SweepResults:
    """Many runs of a scenario: a sweep file, or the name of a shipped one. Goes on with a folder it began.

    jobs: threads; 0: one for each processor. Other Python threads may run meanwhile; Ctrl-C keeps what is done.
    """
    _core._sweep(_file_of(file, "sweeps"), os.fspath(out), jobs, lambda name: _file_of(name, "scenarios"))
    return SweepResults(out)
