"""A trained network as arrays, so that it plays without the library that trained it. Imports numpy alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

F32 = npt.NDArray[np.float32]
I64 = npt.NDArray[np.int64]


class Network(NamedTuple):
    """Layers one after the other, with an activation between two of them.

    Attributes:
        weights: weights of each layer, float32 [numbers in, numbers out].
        biases: biases of each layer, float32 [numbers out].
        activation: ``tanh`` or ``relu``.
    """

    weights: tuple[F32, ...]
    biases: tuple[F32, ...]
    activation: str

    def choose(self, seen: F32) -> I64:
        """The action of the greatest output for each row, int64 [n], from float32 [n, numbers in]."""
        last = len(self.weights) - 1
        for layer, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            seen = seen @ weight + bias
            if layer < last:
                seen = np.tanh(seen) if self.activation == "tanh" else np.maximum(seen, 0)
        chosen: I64 = seen.argmax(axis=1)
        return chosen

    def save(self, path: Path) -> None:
        """Write it as an .npz file; a file that is there is whole."""
        path.parent.mkdir(parents=True, exist_ok=True)
        aside = path.with_suffix(".part")
        with aside.open("wb") as written:
            arrays: dict[str, Any] = {
                "activation": np.array(self.activation),
                **{f"weight_{k}": each for k, each in enumerate(self.weights)},
                **{f"bias_{k}": each for k, each in enumerate(self.biases)}}
            np.savez(written, **arrays)
        aside.rename(path)


def load(path: Path) -> Network:
    """A network that :meth:`Network.save` wrote."""
    with np.load(path, allow_pickle=False) as arrays:
        count = sum(name.startswith("weight_") for name in arrays.files)
        return Network(tuple(arrays[f"weight_{k}"] for k in range(count)),
                       tuple(arrays[f"bias_{k}"] for k in range(count)), str(arrays["activation"]))


def of_modules(modules: Any) -> Network:
    """The network of torch modules in order: linear layers, and one kind of activation, Tanh or ReLU."""
    linear = [each for each in modules if hasattr(each, "weight")]
    between = {type(each).__name__.lower() for each in modules if not hasattr(each, "weight")}
    if not between <= {"tanh", "relu"} or len(between) > 1:
        raise ValueError(f"no plain layers: {modules}")
    return Network(
        tuple(each.weight.detach().cpu().numpy().T.copy() for each in linear),
        tuple(each.bias.detach().cpu().numpy().copy() for each in linear),
        between.pop() if between else "relu")
