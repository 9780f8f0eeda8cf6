"""What the chain of stages needs to know of a machine beyond its `Model`: one file for each kind of machine.

In reading order:
    shop_units  numbers as they are said in the shop
    base     Subject, and View: a model's records laid out for tests and pictures
    indexer  the cam indexing machine, from measured files and a machine YAML
    imagined what could be measured of that machine next
    from_config  that machine from the command's configuration
"""
