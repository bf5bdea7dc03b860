"""What one hostile machine does to a server of `mjsim play` has an end, directly and through NGINX."""

import pytest

from benchmarks.play import FAST
from benchmarks.support.play_hostile import NGINX, measure_hostile
from experiments.web.server.app import NEW_VISITS, SOCKETS_OF_A_VISIT

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("nginx", [False, True])
def test_a_hostile_machine_disturbs_nobody(tmp_path, nginx):
    if nginx and NGINX is None:
        pytest.skip("no NGINX on this machine")
    found = measure_hostile(tmp_path, 400, 3.0, *FAST, nginx=nginx)
    assert found["flood_cut_off"] and found["journal_kb"] < 500.0, "presses do not fill the disk"
    assert found["sockets_served"] <= SOCKETS_OF_A_VISIT
    assert found["visits_begun"] <= NEW_VISITS[0], "nobody speaks for others"
    assert found["errors"] == 0
