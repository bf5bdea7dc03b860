"""How Alembic runs the migrations: on the connection that it is given, in the transaction that is open there."""

from alembic import context

from experiments.visit.store.tables import metadata

context.configure(connection=context.config.attributes["connection"], target_metadata=metadata)
with context.begin_transaction():
    context.run_migrations()
