"""Create all tables in their current form.

Later migrations run on a new database as well, so they skip tables and columns that exist already. MariaDB commits each
table separately, so an interrupted upgrade may have created some of them.
"""

from alembic import op

from experiments.visit.store.tables import metadata

revision = "0001"
down_revision = None


def upgrade() -> None:
    metadata.create_all(op.get_bind())
    for table in metadata.sorted_tables:
        for index in table.indexes:
            index.create(op.get_bind(), checkfirst=True)
