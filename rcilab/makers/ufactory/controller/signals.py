"""Digital and analog signals of the control box and of the tool."""

from __future__ import annotations

from dataclasses import dataclass, field

from rcilab.core.errors import InvalidValueError

BOX_SIGNALS = 16  # Digital inputs, and outputs, of the control box: 0-7, and 8-15.
TOOL_SIGNALS = 5  # The same at the tool.
HIGHEST_CODE = 4095  # Of an analog signal.
BOX_VOLTAGE, TOOL_VOLTAGE = 10.0, 3.3  # [V] At the highest code.


@dataclass(slots=True)
class Signals:
    """All signals. Owned by the controller."""

    loop_back: bool = False
    """Whether every output is wired to the input of the same number, digital and analog."""
    inputs: int = 0
    """Digital inputs: bits 0 to 15 of the control box, from 16 on of the tool."""
    outputs: int = 0
    """Digital outputs, in the same order."""
    analog_inputs: list[int] = field(default_factory=lambda: [0, 0])
    """Of the control box, 0 to 4095."""
    analog_outputs: list[int] = field(default_factory=lambda: [0, 0])
    input_functions: list[int] = field(default_factory=lambda: [0] * BOX_SIGNALS)
    output_functions: list[int] = field(default_factory=lambda: [0] * BOX_SIGNALS)

    def set_loop_back(self, on: bool) -> None:
        """Wires every output to the input of the same number, with its present level, or none."""
        self.loop_back = on
        if on:
            self.inputs, self.analog_inputs = self.outputs, self.analog_outputs.copy()

    def set_input(self, signal: int, level: bool) -> None:
        """Sets the level of a digital input.

        Raises:
            InvalidValueError: There is no such input.
        """
        count = BOX_SIGNALS + TOOL_SIGNALS
        if not 0 <= signal < count:
            raise InvalidValueError("digital input", signal, f"does not exist; known: 0 to {count - 1}")
        self.inputs = _with_bit(self.inputs, signal, level)

    def set_output(self, signal: int, level: bool) -> None:
        """Sets a digital output, and the input it is wired to."""
        self.outputs = _with_bit(self.outputs, signal, level)
        if self.loop_back:
            self.inputs = _with_bit(self.inputs, signal, level)

    def set_analog(self, signal: int, code: int) -> None:
        """Sets an analog output of the control box, 0 to 4095, and the input it is wired to."""
        self.analog_outputs[signal] = min(code, HIGHEST_CODE)
        if self.loop_back:
            self.analog_inputs[signal] = self.analog_outputs[signal]

    def clear_outputs(self, *, box: bool, tool: bool) -> None:
        """Clears outputs, as a stop does where it is configured."""
        for signal in range(BOX_SIGNALS + TOOL_SIGNALS):
            if (box if signal < BOX_SIGNALS else tool) and self.outputs >> signal & 1:
                self.set_output(signal, False)

    @property
    def box_inputs(self) -> int:
        """The digital inputs of the control box, as 16 bits."""
        return self.inputs & 0xFFFF

    @property
    def box_outputs(self) -> int:
        """The digital outputs of the control box, as 16 bits."""
        return self.outputs & 0xFFFF

    @property
    def tool_inputs(self) -> int:
        """The digital inputs of the tool, as bits."""
        return self.inputs >> BOX_SIGNALS

    @property
    def tool_outputs(self) -> int:
        """The digital outputs of the tool, as bits."""
        return self.outputs >> BOX_SIGNALS


def _with_bit(bits: int, signal: int, level: bool) -> int:
    return bits | 1 << signal if level else bits & ~(1 << signal)
