"""A trained classifier as one ONNX file, which runs without this package and without Python.

    graph      nodes and constants of a computation under construction
    features   records -> features, the transform as a product of matrices
    parts      what the model's parts say
    model      the whole classifier as a graph, with all that a user must know in the metadata
    __main__   the command                                             (indexer export)

The modules need the extra [onnx]. All numbers are float64; outputs are those of `Model` to rounding.
"""
