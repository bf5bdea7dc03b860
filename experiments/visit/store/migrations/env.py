"""Alembic environment that runs migrations within the open transaction of an existing connection."""

from alembic import context

from experiments.visit.store.tables import metadata

context.configure(connection=context.config.attributes["connection"], target_metadata=metadata)
with context.begin_transaction():
    context.run_migrations()
