"""Add the table `host` and the column `person.host`, which support several hosts.

A new database has both, and an interrupted upgrade may have added one of them already.
"""

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects import mysql

revision = "0002"
down_revision = "0001"

TIME = sa.DateTime().with_variant(mysql.DATETIME(fsp=6), "mysql")


def upgrade() -> None:
    found = sa.inspect(op.get_bind())
    if "host" not in {column["name"] for column in found.get_columns("person")}:
        op.add_column("person", sa.Column("host", sa.String(100), nullable=True))
    op.create_table(
        "host",
        sa.Column("id", sa.Integer, nullable=False),
        sa.Column("study_id", sa.Integer, nullable=False),
        sa.Column("name", sa.String(100), nullable=False),
        sa.Column("seen", TIME, nullable=False),
        sa.Column("draining", sa.Boolean, nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_host")),
        sa.ForeignKeyConstraint(["study_id"], ["study.id"], name=op.f("fk_host_study_id_study")),
        sa.UniqueConstraint("study_id", "name", name=op.f("uq_host_study_id_name")),
        if_not_exists=True,
        sqlite_autoincrement=True,
        mysql_engine="InnoDB",
        mysql_charset="utf8mb4",
        mysql_collate="utf8mb4_bin",
    )
