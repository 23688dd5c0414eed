"""Writes the chapter "Python" of the book as a notebook: `python notebook.py [FILE]`; python.ipynb if not given."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import nbformat

CHAPTER = Path(__file__).resolve().parents[2] / "docs" / "book" / "src" / "python.md"
BLOCK = re.compile(r"^```python\n(.*?)^```\n", re.MULTILINE | re.DOTALL)


def notebook() -> nbformat.NotebookNode:
    """The chapter, its blocks of Python as cells."""
    made = nbformat.v4.new_notebook()
    for number, part in enumerate(BLOCK.split(CHAPTER.read_text(encoding="utf-8"))):
        new = nbformat.v4.new_code_cell if number % 2 else nbformat.v4.new_markdown_cell
        if part.strip():
            made.cells.append(new(part.strip()))
    return made


if __name__ == "__main__":
    nbformat.write(notebook(), sys.argv[1] if len(sys.argv) > 1 else "python.ipynb")
