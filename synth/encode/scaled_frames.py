"""Samples with their physical full scale, and what follows from them: values, levels, spectrum.

Stage: part of STAGE 4 (encode), pure. `sound` adds the scene.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from synth.scene.effects_section import unit_of

Real = npt.NDArray[np.float64]
UNSCALED = "unscaled"
"""Quantity of a channel of another program's file: its samples have no known full scale."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ScaledFrames:
    """Frames of samples and their scale. `numpy.asarray` gives the values.

    frames: samples in units of `full_scale`, float32 [frames, channels].
    sample_rate: frames per second.
    full_scale: SI value of a sample of 1.0, one per channel.
    quantities: quantity of each channel, such as "acceleration".
    """

    frames: npt.NDArray[np.float32]
    sample_rate: int
    full_scale: tuple[float, ...]
    quantities: tuple[str, ...]

    def __array__(self, dtype: npt.DTypeLike | None = None, copy: bool | None = None) -> npt.NDArray[Any]:
        if copy is False:
            raise ValueError("the values of a Sound are computed: leave copy=False out")
        return self.values.astype(dtype or np.float64, copy=False)

    @property
    def seconds(self) -> float:
        """The duration, s."""
        return len(self.frames) / self.sample_rate

    @property
    def values(self) -> Real:
        """The samples in SI units, float64 [frames, channels]."""
        return np.multiply(self.frames, np.asarray(self.full_scale, dtype=np.float64))

    @property
    def units(self) -> tuple[str, ...]:
        """The SI unit of each channel."""
        return tuple("" if quantity == UNSCALED else unit_of(quantity) for quantity in self.quantities)

    @property
    def times(self) -> Real:
        """The time of each frame, s, float64 [frames]."""
        return np.arange(len(self.frames)) / self.sample_rate

    @property
    def peak(self) -> Real:
        """The largest magnitude of each channel, SI, float64 [channels]."""
        return np.asarray(np.abs(self.values).max(axis=0, initial=0.0), np.float64)

    @property
    def rms(self) -> Real:
        """The root mean square of each channel, SI, float64 [channels]."""
        if not len(self.frames):
            return np.zeros(self.frames.shape[1])
        return np.asarray(np.sqrt(np.mean(self.values**2, axis=0)), np.float64)

    def spectrum(self) -> tuple[Real, Real]:
        """Return the frequencies (Hz, [lines]) and the peak amplitudes (SI, [lines, channels]) of the whole sound.

        The mean is subtracted, and a Hann window is applied. The line of a sinusoid has the sinusoid's amplitude, or up
        to 1.4 dB less if its frequency is between two lines.
        """
        values = self.values - self.values.mean(axis=0) if len(self.frames) else self.values
        window = np.hanning(len(values))
        lines = np.abs(np.fft.rfft(values * window[:, np.newaxis], axis=0)) if len(values) else values
        frequencies = np.fft.rfftfreq(max(1, len(values)), 1.0 / self.sample_rate).astype(np.float64)
        return frequencies, np.asarray(2.0 * lines / max(1.0, float(window.sum())), np.float64)
