"""Completion of the command line: what may come next, and the shell's part."""

from __future__ import annotations

from collections.abc import Iterable

from indexer_cli.manual import keys_of
from indexer_cli.verbs import VERBS, can_sweep

HOW = 'Add to ~/.bashrc:  eval "$(indexer --completion bash)"      to ~/.zshrc:  eval "$(indexer --completion zsh)"'

_BASH = """\
_indexer() {
    local IFS=$'\\n'
    compopt -o nospace 2>/dev/null
    COMPREPLY=($(indexer --complete "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null))
    local word=${COMP_WORDS[COMP_CWORD]} key=
    [[ $word == *=* ]] && key=${word%%=*}=
    [[ ${#COMPREPLY[@]} -eq 0 ]] && COMPREPLY=($(compgen -f -P "$key" -- "${word#*=}"))
}
COMP_WORDBREAKS=${COMP_WORDBREAKS//=}
complete -F _indexer indexer
"""

SHELLS = {"bash": _BASH, "zsh": "autoload -U +X bashcompinit && bashcompinit\n" + _BASH}
"""What a shell must run once, by its name."""

FLAGS = ("--help", "--version", "--completion")
"""What may stand in place of a verb."""

FLAGS_OF_A_VERB = ("--help",)
"""What may stand after one."""

FLAGS_OF_A_SWEEP = ("-m", "--multirun")
"""What may stand, too, after one that writes a folder, in which the jobs of a sweep have theirs."""


def candidates(words: list[str]) -> list[str]:
    """What the last of the words after `indexer` can become: a verb, a word that it takes alone, a key with its sign of
    equality, a key with one of the names of its group, or a flag once its dash is there. A path is left to the
    shell."""
    last = words[-1] if words else ""
    if len(words) <= 1:
        return _beginning(FLAGS if last.startswith("-") else VERBS, last)
    if words[0] == "help":
        return _beginning(VERBS, last) if len(words) == 2 else []
    if words[0] == "--completion":
        return _beginning(SHELLS, last) if len(words) == 2 else []
    if words[0] not in VERBS:
        return []
    keys = keys_of(words[0])
    if last.startswith("-"):
        return _beginning([*FLAGS_OF_A_VERB, *(FLAGS_OF_A_SWEEP if can_sweep(words[0], keys) else ())], last)
    key, sign, _ = last.partition("=")
    if sign:
        return [f"{key}={name} " for name in keys.get(key, []) if f"{key}={name}".startswith(last)]
    alone = [] if set(words[1:-1]) & set(VERBS[words[0]].words) else VERBS[words[0]].words
    return [*_beginning(alone, last), *(f"{name}=" for name in keys if name.startswith(last))]


def _beginning(names: Iterable[str], last: str) -> list[str]:
    return [f"{name} " for name in names if name.startswith(last)]
