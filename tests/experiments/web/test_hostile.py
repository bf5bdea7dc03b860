"""What one hostile machine does to a server of `mjsim play` has an end, directly and through NGINX.

`MJSIM_FAULTS=2000 pytest -s` opens 2,000 sockets of one visit instead of 400, and prints what others noticed.
"""

import os

import pytest
from nginx_site import NGINX

from benchmarks.play import FAST
from experiments.visit.server.admission import NEW_PEOPLE
from experiments.visit.server.trials import SOCKETS_OF_A_PERSON
from tests.experiments.web.hostile_machine import measure_hostile

pytestmark = pytest.mark.slow
SOCKETS = int(os.environ.get("MJSIM_FAULTS", "400"))


@pytest.mark.parametrize("nginx", [False, pytest.param(True, marks=pytest.mark.long)])
def test_a_hostile_machine_disturbs_nobody(tmp_path, nginx):
    if nginx and NGINX is None:
        pytest.skip("no NGINX on this machine")
    found = measure_hostile(tmp_path, SOCKETS, 3.0, *FAST, nginx=nginx)
    print(found)
    assert found["flood_cut_off"] and found["journal_kb"] < 500.0, "presses do not fill the disk"
    assert 1 <= found["sockets_open"] <= SOCKETS_OF_A_PERSON
    assert found["visits_begun"] <= NEW_PEOPLE[0], "nobody speaks for others"
    assert found["errors"] == 0
