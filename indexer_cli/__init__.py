"""The command `indexer`, and what its verbs share: reading the command line, sentences for mistakes, folders.

In reading order:
    verbs          the verbs: which module does the work of each, which file of conf/ holds its keys
    yaml_keys      a file of conf/ -> its summary, its text and its keys with default and meaning
    manual         the help page of a verb, and the list of all verbs
    completion     what may come next on a command line, and the shell's part of it
    pipe           standard output whose reader may leave before the work is done
    __main__       `indexer VERB KEY=VALUE ...`
    arguments      the command line before and around Hydra's reading of it
    typed_keys     a parameter as an object names it -> its key as it is typed
    command        the Hydra entry point of every verb
    places/        a folder on this machine or behind a URL, in which files appear whole or not at all
    job_paths      the paths and URLs that verbs are given, and where each job of a sweep writes
    output_folder  result folders that appear whole or not at all
    words          numbers with their nouns, and the console of what is said
    json_values    plain values that every reader of JSON takes
    sweep          a sweep as one table: job -> what it was given -> what came out

Help must come at once, so the modules down to `__main__` import the standard library alone; a verb's own module is
imported when it runs. What a page says stands in conf/, beside the keys themselves.
"""
