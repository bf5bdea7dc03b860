"""Some commands killed and begun again, as `mjsim bench faults` does with hundreds."""

from benchmarks import faults


def test_killed_commands_end_up_with_the_files_of_undisturbed_ones():
    result = faults.measure(kills=2)
    assert result["kills"] == 2 == sum(result["signals"].values())
    assert [result[r.key] for r in faults.REQUIREMENTS] == [0] * len(faults.REQUIREMENTS), result["faults"]
    text = "\n".join(faults.lines(result))
    assert "2 kills" in text and "FAIL" not in text
