"""Forms made from items, by WTForms."""

from collections.abc import Sequence
from typing import Any

from wtforms import IntegerField, RadioField, SelectMultipleField, StringField, TextAreaField
from wtforms.fields.choices import SelectChoice
from wtforms.form import BaseForm
from wtforms.meta import DefaultMeta
from wtforms.validators import InputRequired, Length, NumberRange, Optional
from wtforms.widgets import CheckboxInput, ListWidget

from experiments.visit.texts import Section
from experiments.visit.texts.items import MAX_LINE, MAX_TEXT, Item


def form_of(items: Sequence[Item], scale: Sequence[str], common: Section, language: str = "en") -> BaseForm:
    """Return a form with a field per item. `scale` has the labels of the points of scales."""
    meta = DefaultMeta()
    meta.locales = [language]  # language of WTForms' own messages
    return BaseForm({item.name: _field(item, scale, common) for item in items}, meta=meta)


def _field(item: Item, scale: Sequence[str], common: Section) -> Any:
    needed: list[Any] = [InputRequired(common["required"]) if item.required else Optional()]
    label = item.text if item.required else f"{item.text} {common['optional']}"
    match item.kind:
        case "scale":
            points = [SelectChoice(str(point), word) for point, word in enumerate(scale, 1)]
            return RadioField(label, needed, choices=points, coerce=int, validate_choice=item.required)
        case "choice":
            choices = [SelectChoice(choice) for choice in item.choices]
            return RadioField(label, needed, choices=choices, validate_choice=item.required)
        case "several":
            widget = {"widget": ListWidget(prefix_label=False), "option_widget": CheckboxInput()}
            return SelectMultipleField(
                label, needed, choices=[SelectChoice(c) for c in item.choices], **widget
            )
        case "number":
            return IntegerField(label, [*needed, NumberRange(item.low, item.high)])
        case "line":
            return StringField(label, [*needed, Length(max=MAX_LINE)])
        case "text":
            return TextAreaField(label, [*needed, Length(max=MAX_TEXT)])
