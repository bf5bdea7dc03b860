"""Shells complete what the parser knows."""

import re
import subprocess

import pytest

from experiments.cli.main import COMMANDS, main

TRY = """
source ./script
COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)) COMP_TYPE=9
_shtab_mjsim "$1" "${!#}"
echo "${COMPREPLY[*]}"
"""


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("", [*COMMANDS]),
        ("run --fid", ["--fidelity"]),
        ("run --fidelity e", ["event"]),
        ("study an", ["analyze"]),
        ("replay scr", ["script"]),
        ("plan scr", ["script"]),
        ("plan --check scr", ["script"]),
    ],
)
def test_bash_completes_commands_options_values_and_files(words, offered, tmp_path, capsys):
    assert main(["completion", "bash"]) == 0
    (tmp_path / "script").write_text(capsys.readouterr().out)
    run = ["bash", "-c", TRY, "bash", "mjsim", *words.split(" ")]
    done = subprocess.run(run, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert set(offered) <= set(done.stdout.split()), done.stderr


def test_the_script_of_zsh_describes_every_command(capsys):
    assert main(["completion", "zsh"]) == 0
    listed = re.findall(r"^    (\S+):'\S", capsys.readouterr().out, re.MULTILINE)
    assert listed[: len(COMMANDS)] == sorted(COMMANDS)
