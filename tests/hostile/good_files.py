"""Good files of every kind, and a process that has loaded all that commands need."""

import asyncio
import contextlib
import itertools
import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import trimesh

FAST = ["--fidelity", "event", "--no-regret", "--no-video", "--no-floor-plan"]
HOUSE_PAGE = Path(__file__).parents[2] / "docs" / "build-a-house.md"
HOUSE_FILES = re.compile(r"^`([\w.]+)`: .*?^```(?:xml|toml)\n(.*?)^```", re.DOTALL | re.MULTILINE)
PROBLEM = {
    "capacity": 2,
    "start": 0,
    "distances": [[0, 3, 5, 4], [3, 0, 4, 2], [5, 4, 0, 3], [4, 2, 3, 0]],
    "shipments": [{"pickup": 1, "delivery": 2}, {"pickup": 3, "delivery": 2}],
    "onboard": [2],
}
DESIGN = """[all_cells]
people = 2
house_seeds = [0, 1]
points = 40
fidelity = "event"
regret = false
time_limit = 5.0
[[cells]]
objects = 2
assistance = "none"
seeds = "0:2"
[[cells]]
objects = 2
assistance = "optimal"
person = { walking_speed = { normal = [1.2, 0.2], min = 0.8 } }
[[exclusions.rules]]
column = "completion_time_s"
comparison = ">"
value = 600
reason = "longer than ten minutes"
"""
PERSON = "walking_speed = 1.2\nreach = 0.8\nreading_time = { uniform = [0.5, 2.0] }\n"
RULES = DESIGN[DESIGN.index("[[exclusions") :].replace("exclusions.", "")
MESHES = ("box.obj", "box.stl", "box.ply", "box.glb")
KEPT = ("keep.txt", "keep.csv", "keep.json", "keep.xml", "keep.mp4", "keep/this.txt", "story.txt")
ONCE = f"""
run --objects 2 --out run {" ".join(FAST)}
batch --objects 2 --assistance none,optimal --seeds 0:2 --workers 1 --fidelity event --no-regret --out batch
plan problem.json --certificate claim.json
study preregister design.toml --out frozen.zip
replay run
metrics batch
compare batch
study analyze people --out gone
check home/catalogue.toml
study init study.toml
"""
NO_FILM = 'phases = ["consent", "training", "task", "survey", "completion"]\n[study.pay]'


def prepare(folder: Path) -> None:
    """Write good files, load what commands need, and let `mjsim play` serve nobody."""
    import uvicorn

    from experiments.cli.main import COMMANDS, main, parser
    from experiments.web.server.pool import WorkerPool

    parser(*COMMANDS)

    async def serve_nobody(*_: Any, **__: Any) -> None:
        """Let `mjsim play` and `mjsim study serve` end at once."""

    uvicorn.Server.serve = serve_nobody  # type: ignore
    WorkerPool.warm_up = lambda *_, **__: None  # type: ignore
    (folder / "home").mkdir()
    (folder / "people").mkdir()
    texts = {
        "problem.json": json.dumps(PROBLEM),
        "design.toml": DESIGN,
        "person.toml": PERSON,
        "rules.toml": RULES,
    }
    texts |= {f"home/{name}": text for name, text in HOUSE_FILES.findall(HOUSE_PAGE.read_text("utf-8"))}
    for name, text in (texts | dict.fromkeys(KEPT, "kept\n")).items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text)
    for name in MESHES:
        trimesh.creation.box((0.1, 0.08, 0.06)).export(folder / name)
    pa.parquet.write_table(pa.Table.from_pylist(made_up_rows()), folder / "people" / "trials.parquet")
    with (
        contextlib.chdir(folder),
        Path("/dev/null").open("w") as nowhere,
        contextlib.redirect_stdout(nowhere),
        contextlib.redirect_stderr(nowhere),
    ):
        for line in ONCE.strip().splitlines():
            if code := main(line.split()):
                raise RuntimeError(f"mjsim {line} ended with {code}")
    shutil.rmtree(folder / "gone")
    shutil.copy(folder / "run" / "episode.json", folder)
    study = (folder / "study.toml").read_text()
    study = study[: study.index("[study.minimum]")] + study[study.index("[study.pay]") :]
    (folder / "study.toml").write_text(study.replace("[study.pay]", NO_FILM))
    asyncio.run(_played(folder))


async def _played(folder: Path) -> None:
    """A study in which one person has played, and its backup."""
    from experiments.record.files import sha256_of
    from experiments.visit.store import Store

    served = folder / "served"
    shutil.copytree(folder / "run", served / "visits" / ("a" * 64) / "task")
    store = await Store.open(f"sqlite:///{served / 'study.db'}", "my-study", sha256_of(folder / "study.toml"))
    person = await store.arrive("link", None, {}, "a" * 64, "task")
    await store.finish_trial(person.id, "task", f"visits/{'a' * 64}/task", "all delivered")
    await store.finish_phase(person.id, "task", "survey", {}, "all delivered")
    await store.backup(folder / "backup.db")
    await store.close()


def made_up_rows(people: int = 4) -> list[dict[str, Any]]:
    """A table of people in four cells."""
    rng = np.random.default_rng(0)
    rows: list[dict[str, Any]] = []
    for assistance, objects in itertools.product(("none", "optimal"), (6, 12)):
        for k in range(len(rows), len(rows) + people):
            who = {"user": "human", "participant": f"p{k}", "house": "apartment", "house_seed": 1}
            seeds = {"person_seed": k, "order_seed": k, "ended": "all delivered", "visits": 2 * objects}
            measures = {
                "nd_feasible": float(rng.uniform()),
                "nd_strict_2n": float(rng.integers(2 * objects)) / (2 * objects),
                "ipl_locations": float(rng.uniform(0.5, 1)),
                "task_distance_m": float(rng.uniform(40, 90)),
                "completion_time_s": float(rng.uniform(100, 500)),
                "likert_useful": int(rng.integers(1, 6)),
            }
            rows.append({"objects": objects, "assistance": assistance, **who, **seeds, **measures})
    return rows
