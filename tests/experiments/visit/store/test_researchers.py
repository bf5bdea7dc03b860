"""Researchers: passwords, roles, and logins that end."""

from datetime import UTC, datetime, timedelta

import pytest
from store_clock import at

from experiments.errors import StoreError
from experiments.visit.store import Store, utc_now

pytestmark = pytest.mark.anyio

NOON = datetime(2026, 5, 1, 12, tzinfo=UTC)
TOKEN = "a" * 64


async def test_a_password_opens_and_is_not_kept(store):
    ada = await store.researchers.add("ada", "correct horse", "owner")
    assert await store.researchers.check("ada", "correct horse") == ada
    assert await store.researchers.check("ada", "Correct horse") is None
    assert await store.researchers.check("bob", "correct horse") is None
    assert await store.researchers.all() == (ada,)
    assert "horse" not in repr(ada)


async def test_passwords_are_hashed_with_the_memory_of_rfc_9106_by_default(tmp_path):
    store = await Store.open(f"sqlite:///{tmp_path / 'study.db'}", "pilot", "0" * 64)
    try:
        assert (await store.researchers._hash("correct horse")).startswith("$argon2id$v=19$m=65536,t=3,")
    finally:
        await store.close()


async def test_a_login_ends_by_time_by_logging_out_and_by_a_change(store):
    researchers = store.researchers
    ada = await researchers.add("ada", "correct horse", "owner")
    with at(NOON):
        for token in "abc":
            await researchers.log_in(ada.id, token * 64, NOON + timedelta(hours=8))
        assert await researchers.who("a" * 64) == ada
    with at(NOON + timedelta(hours=8)):
        assert await researchers.who("a" * 64) is None
    with at(NOON):
        await researchers.log_out("a" * 64)
        assert await researchers.who("a" * 64) is None
        assert await researchers.who("b" * 64) == ada
        await researchers.change("ada", password="battery staple")
        assert await researchers.who("b" * 64) is None
    assert await researchers.check("ada", "correct horse") is None
    assert await researchers.check("ada", "battery staple") == ada


async def test_who_is_disabled_cannot_come_in(store):
    ada = await store.researchers.add("ada", "correct horse", "viewer")
    await store.researchers.log_in(ada.id, TOKEN, utc_now() + timedelta(hours=8))
    await store.researchers.change("ada", disabled=True)
    assert await store.researchers.who(TOKEN) is None
    assert await store.researchers.check("ada", "correct horse") is None
    await store.researchers.change("ada", disabled=False, role="assistant")
    assert (await store.researchers.check("ada", "correct horse")).role == "assistant"
    assert await store.researchers.who(TOKEN) is None


async def test_names_and_roles_that_cannot_be(store):
    await store.researchers.add("ada", "correct horse", "owner")
    with pytest.raises(StoreError, match="'ada' already"):
        await store.researchers.add("ada", "other", "viewer")
    with pytest.raises(StoreError, match="owner, assistant, viewer"):
        await store.researchers.add("bob", "other", "admin")
    for name in ("", "Ada", "a b", "a\0", "<b>", "x" * 61):
        with pytest.raises(StoreError, match="cannot be a name"):
            await store.researchers.add(name, "other", "viewer")
        assert await store.researchers.check(name, "other") is None
    with pytest.raises(StoreError, match="no researcher 'bob'"):
        await store.researchers.change("bob", disabled=True)
