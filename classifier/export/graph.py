"""Nodes and constants of a computation under construction; tensors go by their names."""

from __future__ import annotations

from typing import Any

import numpy as np
import onnx
from onnx import helper, numpy_helper

OPSET = 17
"""Version of the operators: the first with all that is used, so that old runtimes can open the file too."""

_IR_VERSION = 8


class Graph:
    """A computation in float64 to which nodes are added one by one."""

    def __init__(self) -> None:
        self._nodes: list[onnx.NodeProto] = []
        self._constants: list[onnx.TensorProto] = []
        self._inputs: list[onnx.ValueInfoProto] = []
        self._outputs: list[onnx.ValueInfoProto] = []

    def input(self, name: str, width: int) -> str:
        """An input (n, width) of float64, n free."""
        self._inputs.append(helper.make_tensor_value_info(name, onnx.TensorProto.DOUBLE, ["n", width]))
        return name

    def constant(self, value: np.ndarray | float) -> str:
        """A constant; whole numbers as int64, all others as float64."""
        array = np.asarray(value)
        array = array.astype(np.int64 if array.dtype.kind in "iu" else np.float64)
        name = f"constant_{len(self._constants)}"
        self._constants.append(numpy_helper.from_array(np.ascontiguousarray(array).reshape(array.shape), name))
        return name

    def add(self, operator: str, *inputs: str | np.ndarray | float, **attributes: Any) -> str:
        """The first output of a node; inputs that are no name become constants."""
        names = [value if isinstance(value, str) else self.constant(value) for value in inputs]
        return self._node(operator, names, 1, attributes)[0]

    def smallest(self, values: str, count: int) -> str:
        """The smallest values along the last axis, (…, count)."""
        inputs = [values, self.constant(np.array([count]))]
        return self._node("TopK", inputs, 2, {"axis": -1, "largest": 0})[0]

    def _node(self, operator: str, inputs: list[str], outputs: int, attributes: dict[str, Any]) -> list[str]:
        names = [f"{operator.lower()}_{len(self._nodes)}_{place}" for place in range(outputs)]
        self._nodes.append(helper.make_node(operator, inputs, names, **attributes))
        return names

    def output(self, name: str, tensor: str, *shape: int, kind: int = onnx.TensorProto.DOUBLE) -> None:
        """Give a tensor (n, *shape) out under a name."""
        self._nodes.append(helper.make_node("Identity", [tensor], [name]))
        self._outputs.append(helper.make_tensor_value_info(name, kind, ["n", *shape]))

    def model(self, name: str, metadata: dict[str, str]) -> onnx.ModelProto:
        """The finished model, checked."""
        graph = helper.make_graph(self._nodes, name, self._inputs, self._outputs, self._constants)
        model = helper.make_model(
            graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=_IR_VERSION, producer_name=name
        )
        helper.set_model_props(model, metadata)
        onnx.checker.check_model(model, full_check=True)
        return model
