"""Texts and labels in all languages: none is missing, and none is there that nothing shows."""

import dataclasses
import re
import tomllib
from pathlib import Path
from typing import get_args

import hud_sample as sample
import numpy as np
import pytest

import experiments
from experiments.errors import ConfigError
from experiments.house import TEXTS, read_words
from experiments.study.file import PHASES
from experiments.web.protocol import PauseReason
from hud.compose import Compositor, compose
from hud.conditions import condition
from hud.messages import KINDS, message
from hud.state import BinEntry
from hud.text import Typeface
from hud.texts import HudTexts
from hud.theme import ITEM
from mjsim.generator.default_furniture import SHOWN_NAMES
from mjsim.generator.furniture.catalogue import KINDS as FURNITURE
from mjsim.generator.programme import NEEDS
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.catalogue.house_ref import models_root
from mjsim.values.errors import AssetError

LANGUAGES = sorted(path.stem for path in TEXTS.glob("*.toml"))
CLIENT = Path(experiments.__file__).parent / "web/client"
ON_THE_PAGE = ("common", "hud", "trial")  # sections whose texts the page of a trial has


def code(*patterns):
    """Source of the files that show texts."""
    root = Path(experiments.__file__).parents[1]
    files = [path for pattern in patterns for path in root.glob(pattern) if "node_modules" not in path.parts]
    return "\n".join(path.read_text("utf-8") for path in files if "vendor" not in path.parts)


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_language_has_all_texts_of_the_english_file_and_no_others(language):
    keys, english = (
        {(s, key) for s, table in read_words(name).items() for key in table} for name in (language, "en")
    )
    assert keys == english
    assert {field.name for field in dataclasses.fields(HudTexts)} == set(read_words(language)["hud"])


def replaced(key):
    """True if a text of `mjsim play` replaces one of another section."""
    section, _, name = key.partition("_")
    return name in read_words().get(section, {})


def test_each_text_is_shown_somewhere():
    shown = code(
        "experiments/cli/play_plan.py",
        "experiments/study/**/*.py",
        "experiments/visit/**/*.py",
        "experiments/web/**/*.py",
        "hud/**/*.py",
        "experiments/record/*.py",
        "experiments/trials/*.py",
    )
    shown += code("experiments/web/client/static/**/*.js", "experiments/web/client/templates/**/*.html")
    prefixes = tuple(re.findall(r"[`\"](\w+_)\$\{", shown))
    named = set(re.findall(r"(?<=[\"'`])\w+(?=[\"'`])|(?<=texts\.)\w+", shown))
    unused = [
        f"{section}.{key}"
        for section, table in read_words().items()
        for key in table
        if key not in named
        and not (section == "trial" and key.startswith(prefixes))
        and not (key.endswith("_title") and key.removesuffix("_title") in table)
        and not (section == "hud" and key in KINDS)
        and not (section == "play" and replaced(key))
        and not (section in PHASES and key in ("title", "text", "item", "scale"))
    ]
    assert not unused


def test_each_text_that_the_page_of_a_trial_shows_is_there():
    scripts, templates = (
        code("experiments/web/client/static/**/*.js"),
        code("experiments/web/client/templates/*.html"),
    )
    words = read_words()
    there = {key for section in ON_THE_PAGE for key in words[section]}
    assert sum(len(words[section]) for section in ON_THE_PAGE) == len(there), "a name has two texts"
    named = set(re.findall(r'textOf\("(\w+)"', scripts)) | set(re.findall(r"texts\.(\w+)", templates))
    named |= {
        name
        for names in re.findall(r"\bdialog\(([^)]*)\)", scripts)
        for name in re.findall(r'"([a-z]\w+)"', names)
    }
    named |= {f"paused_{reason.replace(' ', '_')}" for reason in get_args(PauseReason)}
    actions = re.findall(r'\{ name: "(\w+)".*?pad: "(\w+ ?\w*)"(.*)', scripts)
    named |= {f"action_{name}" for name, _, _ in actions} | {
        pad for _, pad, rest in actions if "axes" in rest
    }
    actions_of_dialogs = {"run", "takeover", "reload", "leave", "hide"}
    missing = named - there - set(words["result"]) - actions_of_dialogs
    assert len(actions) == 15 and len(named) > 100 and not missing


def test_an_unknown_language_is_refused_with_those_that_there_are():
    with pytest.raises(ConfigError, match="no texts in language 'tlh'; there are de, en"):
        read_words("tlh")


def generated_labels():
    """All labels and places that the generator of homes writes, but those of the apartment."""
    furniture = {SHOWN_NAMES.get(kind, kind.replace("_", " ")) for kind in FURNITURE}
    rooms = {needs.label for needs in NEEDS.values()}
    return (
        rooms
        | {f"on the floor, by the {name}" for name in furniture}
        | {"on the floor, against the wall", "against the wall"}
    )


def shown_labels(catalogue):
    entries = [*catalogue.objects.values(), *catalogue.receptacles.values(), *catalogue.categories.values()]
    places = [receptacle.place for receptacle in catalogue.receptacles.values()]
    return {catalogue.label, *catalogue.rooms.values(), *(entry.label for entry in entries), *places}


@pytest.mark.parametrize("language", [name for name in LANGUAGES if name != "en"])
def test_the_apartment_and_generated_homes_have_all_labels_in_each_language(language):
    labels = tomllib.loads((models_root() / f"labels.{language}.toml").read_text("utf-8"))
    assert set(labels) == shown_labels(Catalogue.load()) | generated_labels()
    objects = [entry.label for entry in Catalogue.load().in_language(language).objects.values()]
    assert len(set(objects)) == len(objects), "two objects have one label"


def test_a_house_without_labels_falls_back_to_english_and_its_own_take_precedence(tmp_path):
    folder = tmp_path / "home"
    folder.mkdir()
    (folder / "catalogue.toml").write_text(
        'extends = "apartment"\n[objects.mug]\nlabel = "Gift"\nmodel = "objects/mug.xml"\n'
    )
    plain = Catalogue.load(str(folder))
    assert (plain.in_language("nl"), shown_labels(plain.in_language("nl"))) == (plain, shown_labels(plain))
    (folder / "labels.de.toml").write_text('Gift = "Geschenk"\n"Toy train" = "Eisenbahn"\n')
    german = plain.in_language("de")
    assert german.content == plain.content, "records name the same house"
    names = [german.objects[key].label for key in ("mug", "toy_train", "ball")]
    assert [*names, german.rooms["kitchen"]] == ["Geschenk", "Eisenbahn", "Wasserball", "Küche"]


@pytest.mark.parametrize("content", ["Mug = 3", "Mug = ", 'Mug = "  "', '[objects]\nMug = "Tasse"'])
def test_a_bad_file_of_labels_is_named(tmp_path, content):
    folder = tmp_path / "home"
    folder.mkdir()
    (folder / "catalogue.toml").write_text('extends = "apartment"\n')
    (folder / "labels.de.toml").write_text(content)
    with pytest.raises(AssetError, match=r"cannot read labels .*labels\.de\.toml"):
        Catalogue.load(str(folder)).in_language("de")


@pytest.mark.parametrize("name", ["none", "highlight", "optimal", "guided-regret"])
def test_a_german_display_has_no_english_word(name):
    german = sample.texts("de")
    view = dataclasses.replace(sample.task(24, steps=3), texts=german, message=message("hands_full", german))
    state = condition(name)(view)
    assert state.checklist_title in ("Aufzuräumen", "Ihr Plan") and state.message.text.startswith(
        "Mehr können Sie"
    )
    if name == "optimal":
        assert state.checklist[3].detail.startswith("Ablegen: ") and state.checklist[4].detail.startswith(
            "Aufheben ·"
        )
    frame = np.zeros((480, 640, 3), np.uint8)
    drawn, english = (compose(frame, state, {}, texts) for texts in (german, sample.TEXTS))
    assert (drawn != english).any(), "counts, hands and the title of the bins are drawn in the language"


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("size", [(640, 480), (1280, 720)])
def test_the_bins_of_the_apartment_are_read_whole(language, size):
    catalogue, texts = Catalogue.load().in_language(language), sample.texts(language)
    bins = tuple(
        BinEntry(entry.label, f"{catalogue.rooms[entry.room]}, {entry.place}")
        for entry in catalogue.receptacles.values()
    )
    state = dataclasses.replace(condition("none")(sample.task(6)), bins=bins)
    rows = Compositor({}, texts).layout(state, *size).bin_rows
    assert [" ".join(row.detail) for row in rows] == [entry.place for entry in bins]


def test_german_letters_are_drawn():
    typeface = Typeface(2.0)
    unknown = typeface.rasterise("\U0010fffd", ITEM)[0]
    for letter, plain in zip("äöüÄÖÜß„“→·", "aouAOUBxx--", strict=True):
        drawn = typeface.rasterise(letter, ITEM)[0]
        assert drawn.any()
        for other in (unknown, typeface.rasterise(plain, ITEM)[0]):
            assert drawn.shape != other.shape or (drawn != other).any(), letter
