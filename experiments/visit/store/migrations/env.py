"""Alembic's environment: runs the migrations on the given connection, in its open transaction."""

from alembic import context

from experiments.visit.store.tables import metadata

context.configure(connection=context.config.attributes["connection"], target_metadata=metadata)
with context.begin_transaction():
    context.run_migrations()
