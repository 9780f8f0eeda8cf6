"""The command `indexer`: its verbs, their help pages, completion of the command line.

In reading order:
    verbs        the verbs: which function does the work of each, which file of conf/ holds its keys
    yaml_keys    a file of conf/ -> its summary, its text and its keys with default and meaning
    manual       the help page of a verb, and the list of all verbs
    completion   what may come next on a command line, and the shell's part of it
    __main__     `indexer VERB KEY=VALUE ...`

Help must come at once, so these modules import the standard library alone; the verb's own module is imported when it
runs. What a page says stands in conf/, beside the keys themselves.
"""
