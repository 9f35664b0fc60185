"""What README, docs, help and messages show a reader: commands, Python, links."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from omegaconf import OmegaConf

from twbal.cli.main import STAGES

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
PROGRAMS = ("twbal", "make", "python", "pip", "git", "ray", "rerun", "sh", ".", ".venv/bin/")
_FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_SPAN = re.compile(r"`([^`\n]+)`")
_STAGE = "|".join(sorted(STAGES, key=len, reverse=True))
_SETTING = r"(?: -m| [+~]{0,2}[\w@./]+=[^\s;,`]*[^\s;,.:`)]| [+~]{0,2}[\w@./]+=\.\.\.)"
_IN_PROSE = re.compile(rf"\btwbal (?:{_STAGE})\b{_SETTING}*")


class Shown(NamedTuple):
    """A command or a piece of Python as a reader finds it."""

    text: str
    place: str  # file and line


class Block(NamedTuple):
    """A fenced block of a page."""

    language: str
    text: str
    place: str


def blocks(page: Path) -> list[Block]:
    whole = page.read_text()
    return [Block(found[1], found[2], _place(page, whole, found.start(2))) for found in _FENCE.finditer(whole)]


def commands() -> list[Shown]:
    """Every command that is shown anywhere, first come, once each."""
    everything = [
        *(shown for page in PAGES for shown in _on_page(page)),
        *(shown for entry in sorted((ROOT / "conf").glob("*.yaml")) for shown in _in_help(entry)),
        *(shown for module in sorted((ROOT / "twbal").rglob("*.py")) for shown in _in_messages(module)),
    ]
    first: dict[str, Shown] = {}
    for shown in everything:
        first.setdefault(shown.text, shown)
    return list(first.values())


def _on_page(page: Path) -> Iterator[Shown]:
    for block in blocks(page):
        if not block.language:
            yield from (Shown(text, block.place) for text in _lines(block.text))
    whole = page.read_text()
    prose = _FENCE.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), whole)
    for found in _SPAN.finditer(prose):
        if _is_command(found[1]):
            yield Shown(found[1], _place(page, prose, found.start()))


def _lines(block: str) -> Iterator[str]:
    """The commands of a block: all lines, or those behind a prompt where it shows answers too."""
    lines = block.replace("\\\n", " ").splitlines()
    prompted = [line.removeprefix("$ ") for line in lines if line.startswith("$ ")]
    for line in prompted or lines:
        for part in re.sub(r"\s+#.*", "", line).split(" && "):
            if text := " ".join(part.removesuffix("&").split()):
                yield text


def _is_command(span: str) -> bool:
    """Whether `code` in prose is a command; `twbal plot` alone only names a stage, `twbal.learn(...)` a function."""
    first, *rest = span.split()
    if first in STAGES:
        return bool(rest)
    named = first == "twbal" and len(rest) == 1 and rest[0] in STAGES
    return bool(rest) and first.startswith(PROGRAMS) and not first.startswith(("..", "twbal.")) and not named


def _in_help(entry: Path) -> Iterator[Shown]:
    """Commands in the header of `twbal <stage> --help`: each ends where a column of explanations begins."""
    header = str(OmegaConf.select(OmegaConf.load(entry), "hydra.help.header") or "")
    for line in header.splitlines():
        text = re.sub(r"^next  +", "", line.strip())
        if re.match(rf"twbal (?:{_STAGE})\b(?![:-])", text):
            yield Shown(re.split(r"  +", text)[0], f"conf/{entry.name} (help)")


def _in_messages(module: Path) -> Iterator[Shown]:
    """Commands with settings in the texts of a module, but for docstrings."""
    tree = ast.parse(module.read_text())
    docs = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docs:
            for found in _IN_PROSE.finditer(node.value):
                if "=" in found[0]:
                    yield Shown(found[0], f"{module.relative_to(ROOT)} line {node.lineno}")


def _place(page: Path, whole: str, at: int) -> str:
    return f"{page.relative_to(ROOT)} line {whole.count(chr(10), 0, at) + 1}"
