"""The code blocks of a Markdown page, with the mark that stands above a block.

A mark is an HTML comment on the line above the fence: "not run: REASON", or the name of a command with its own test.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

FENCED = re.compile(r"(?:^<!-- (?P<mark>[^\n]*?) -->\n)?^```(?P<language>[a-z]*)\n(?P<text>.*?)^```$", re.M | re.S)


@dataclass(frozen=True)
class CodeBlock:
    """One fenced block: its language and its mark ("" where there is none), its text, and the line of its fence."""

    language: str
    text: str
    line: int
    mark: str


def code_blocks(page: str) -> list[CodeBlock]:
    """Return the blocks of the Markdown text `page`, in order."""
    return [
        CodeBlock(
            found["language"], found["text"], page.count("\n", 0, found.start("language")) + 1, found["mark"] or ""
        )
        for found in FENCED.finditer(page)
    ]


def marked_command(page: str, mark: str) -> str:
    """Return the one line of shell under `mark`."""
    (block,) = [block for block in code_blocks(page) if block.mark == mark]
    assert block.language == "sh"
    assert block.text.count("\n") == 1, "a command to paste is one line"
    return block.text.removesuffix("\n")
