"""Write the JSON Schemas of the commands' documents into docs/reference/schemas.

python -m tools.json_schemas
"""

import json
from pathlib import Path

from sandbox.cli.json_schemas import DOCUMENTS, document_schema

FOLDER = Path(__file__).parents[1] / "docs" / "reference" / "schemas"


def schema_text(command: str) -> str:
    """Return the text of the schema file of a command."""
    return json.dumps(document_schema(command), indent=1, ensure_ascii=False) + "\n"


def main() -> None:
    """Write the schema file of each command."""
    FOLDER.mkdir(exist_ok=True)
    for command in DOCUMENTS:
        (FOLDER / f"{command}.schema.json").write_text(schema_text(command), encoding="utf-8")


if __name__ == "__main__":
    main()
