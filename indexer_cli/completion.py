"""Completion of the command line: what may come next, and the shell's part."""

from __future__ import annotations

from indexer_cli.manual import keys_of
from indexer_cli.verbs import VERBS

HOW = 'Add to ~/.bashrc:  eval "$(indexer --completion bash)"      to ~/.zshrc:  eval "$(indexer --completion zsh)"'

_BASH = """\
_indexer() {
    local IFS=$'\\n'
    compopt -o nospace 2>/dev/null
    COMP_WORDBREAKS=${COMP_WORDBREAKS//=}
    COMPREPLY=($(indexer --complete "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null))
    local word=${COMP_WORDS[COMP_CWORD]} key=
    [[ $word == *=* ]] && key=${word%%=*}=
    [[ ${#COMPREPLY[@]} -eq 0 ]] && COMPREPLY=($(compgen -f -P "$key" -- "${word#*=}"))
}
complete -F _indexer indexer
"""

SHELLS = {"bash": _BASH, "zsh": "autoload -U +X bashcompinit && bashcompinit\n" + _BASH}
"""What a shell must run once, by its name."""


def candidates(words: list[str]) -> list[str]:
    """What the last of the words after `indexer` can become: a verb, a key with its sign of equality, or a key with
    one of the names of its group. A path is left to the shell."""
    last = words[-1] if words else ""
    if len(words) <= 1:
        return [f"{name} " for name in VERBS if name.startswith(last)]
    if words[0] == "help":
        return [f"{name} " for name in VERBS if len(words) == 2 and name.startswith(last)]
    if words[0] not in VERBS:
        return []
    keys = keys_of(words[0])
    key, sign, _ = last.partition("=")
    if sign:
        return [f"{key}={name} " for name in keys.get(key, []) if f"{key}={name}".startswith(last)]
    return [f"{name}=" for name in keys if name.startswith(last)]
