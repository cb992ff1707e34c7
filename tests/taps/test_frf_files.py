"""Universal files of frequency responses, as pyuff and others write them: read whole, or refused with what is wrong."""

import numpy as np
import pytest
import pyuff

import fem_impact as fi
from fem_impact.modes import universal_files
from fem_impact.taps import readers, transfer

# its writer leaves binary files open
pytestmark = [
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
    pytest.mark.usefixtures("read_here"),
]
X = np.arange(1.0, 201.0)  # Hz
H = -(X**2) / (100.0**2 - X**2 + 2j * X)  # 1/kg
KINDS = {"ordinate_spec_data_type": 12, "orddenom_spec_data_type": 13, "abscissa_spec_data_type": 18, "func_type": 4,
         "ord_data_type": 6}  # fmt: skip
NODES = {"type": 15, "node_nums": [1, 2], "def_cs": [0, 0], "disp_cs": [0, 0], "color": [1, 1], "x": [0.1, 0.3],
         "y": [0.0, 0.0], "z": [0.0, 0.0]}  # fmt: skip
FEET = {"type": 164, "units_code": 2, "units_description": "foot", "temp_mode": 1, "length": 2.0, "force": 0.5,
        "temp": 1.0, "temp_offset": 1.0}  # fmt: skip


def response(node, data=H, **codes):
    return universal_files.function(f"point {node}", node, 3, X, data) | KINDS | codes


def coherence(node, value):
    return response(node, np.full(200, value), func_type=6, ord_data_type=4)


@pytest.fixture
def written(tmp_path):
    def written(*sets):
        pyuff.UFF(str(tmp_path / "a.uff")).write_sets(list(sets), mode="overwrite")
        return tmp_path / "a.uff"

    return written


def by_hand(values, code, units):
    """A data set 58 as the format has it, single precision: six columns of 13 characters."""
    numbers = "".join(f"{x:13.5e}" for x in np.column_stack([values.real, values.imag]).ravel())
    axis = "{:10d}    0    0    0 {:<20} {:<20}"
    head = [
        "    -1", "    58", "FRF by hand", "NONE", "24-NOV-20 10:00:00", "NONE", "NONE",
        f"{4:5d}{0:10d}{0:5d}{0:10d} {'NONE':<10}{2:10d}{3:4d} {'NONE':<10}{1:10d}{-3:4d}",
        f"{5:10d}{len(values):10d}{1:10d}{1.0:13.5e}{1.0:13.5e}{0.0:13.5e}",
        axis.format(18, "Frequency", "Hz"), axis.format(code, "Acceleration", units), axis.format(13, "Force", "N"),
        axis.format(0, "NONE", "NONE"),
    ]  # fmt: skip
    return "\n".join([*head, *(numbers[i : i + 78] for i in range(0, len(numbers), 78)), "    -1", ""])


def test_a_file_tells_ends_coordinates_and_coherence(written):
    sets = [NODES, response(1), response(2, 0.5 * H, binary=1), coherence(1, 0.9), coherence(2, 0.9)]
    found = transfer.arrays(written(*sets))
    assert np.allclose(found["H"], np.column_stack([H, 0.5 * H]), rtol=1e-9)
    assert found["ways"].tolist() == [[1, 3, 1, 3], [2, 3, 1, 3]] and (found["coherence"] == 0.9).all()
    assert found["place"].tolist() == [[0.1, 0.0, 0.0], [0.3, 0.0, 0.0]]
    assert found["struck"].tolist() == [[0.1, 0.0, 0.0]] * 2
    assert "coherence" not in transfer.arrays(written(response(1)))
    assert np.allclose(transfer.arrays(written(FEET, response(1)))["H"][:, 0], 0.25 * H, rtol=1e-9)


def test_a_file_gives_modes_as_it_stands_and_after_writing_again(written, tmp_path):
    given = fi.frf(written(NODES, response(1), response(2, 0.5 * H)))
    modes = fi.Modes.from_frf(given, mass=2.0)
    assert modes.frequencies == pytest.approx([100.0], rel=1e-6) and modes.damping_ratio == pytest.approx([0.01])
    assert modes.shape_at([[0.1], [0.3]]).ravel() == pytest.approx([1.0, 0.5], rel=1e-4)
    assert modes.unstated and "node" in given.coords
    transfer.write_uff(tmp_path / "b.uff", given)
    again = transfer.arrays(tmp_path / "b.uff")
    assert again["ways"].tolist() == [[1, 3, 1, 3], [2, 3, 1, 3]] and np.allclose(again["H"], given.H, rtol=1e-4)


@pytest.mark.parametrize(("code", "units", "factor"), [(12, "g", 9.80665), (0, "mm/s/N", 1e-3)])
def test_a_file_by_hand_has_its_own_units(tmp_path, code, units, factor):
    (tmp_path / "hand.uff").write_text(by_hand(H, code, units))
    found = transfer.arrays(tmp_path / "hand.uff")
    assert np.allclose(found["H"][:, 0], factor * H, rtol=1e-4)
    assert found["units"] == ["m/s^2/N" if code else "m/s/N"]
    assert found["ways"].tolist() == [[2, 3, 1, -3]] and "place" not in found


@pytest.mark.parametrize(("over", "under", "factor", "told"), [
    ("mm/s2", "N", 1e-3, False), ("(m/s²)/N", "NONE", 1.0, False), ("m/s**2/lbf", "NONE", 1 / 4.4482216, False),
    ("g/kN", "NONE", 9.80665e-3, False), ("g/kN", "kN", 9.80665e-3, False), ("mV", "N", 1.0, True),
    ("m/s^2", "pounds", 1.0, True),
])  # fmt: skip
def test_units_of_a_response_are_followed_or_told(written, over, under, factor, told):
    found = transfer.arrays(written(response(1, ordinate_axis_units_lab=over, orddenom_axis_units_lab=under)))
    assert np.allclose(found["H"][:, 0], factor * H, rtol=1e-6)
    assert any("is not known" in note for note in found["notes"].tolist()) == told


@pytest.mark.parametrize(("label", "factor", "told"), [
    ("Hz", 1.0, False), ("kHz", 1e3, False), ("rad/s", 0.5 / np.pi, False), ("RPM", 1.0 / 60.0, False),
    ("bananas", 1.0, True),
])  # fmt: skip
def test_units_of_the_frequencies_are_followed_or_told(written, label, factor, told):
    found = transfer.arrays(written(response(1, abscissa_axis_units_lab=label)))
    assert np.allclose(found["frequency"], factor * X, rtol=1e-6)
    assert any("of its frequencies is not known" in note for note in found["notes"].tolist()) == told


def test_without_a_code_of_the_denominator_force_is_assumed_and_told(written):
    found = transfer.arrays(written(response(1, orddenom_spec_data_type=0)))
    assert found["notes"].tolist() == ["point 1: what it is divided by is not stated, N assumed"]


def test_labels_against_the_system_of_units_are_told(written):
    """They decide, as most programs write them right."""
    labels = {"ordinate_axis_units_lab": "m/s^2", "orddenom_axis_units_lab": "N"}
    found = transfer.arrays(written(response(1, **labels), FEET))
    assert np.allclose(found["H"][:, 0], H, rtol=1e-6)
    wanted = [
        f"point 1: taken in {unit}, as it is labelled, not in the unit of data set 164" for unit in ("m/s^2", "N")
    ]
    assert found["notes"].tolist() == wanted
    agreed = labels | {"ordinate_axis_units_lab": "mm/s^2", "orddenom_axis_units_lab": "mN"}
    system = FEET | {"length": 1e3, "force": 1e3}
    assert not transfer.arrays(written(response(1, **agreed), system))["notes"].size


WRONG = [
    ([response(1, np.abs(H), ord_data_type=4)], "magnitudes only of 'point 1'; export complex responses"),
    ([response(1, abscissa_spec_data_type=17)], "over something else than frequency"),
    ([response(1, x=X[::-1])], "frequencies of 'point 1' that do not ascend"),
    ([response(1), response(2, x=2.0 * X, abscissa_inc=2.0)], "other frequencies for 'point 2' than for 'point 1'"),
    ([response(1, orddenom_spec_data_type=12)], "no motion per force"),
    ([response(1, ordinate_spec_data_type=13)], "no motion per force"),
    ([response(1), coherence(1, 2.0)], "coherence that is not between"),
    ([response(1, np.where(X == 50.0, np.inf, H))], "no finite number"),
    ([NODES], "holds data sets 15, no frequency responses"),
    ([response(1, H.real, func_type=1)], r"holds time records \(data set 58, function type 1\), no frequency resp"),
]


@pytest.mark.parametrize(
    ("sets", "text", "read"),
    [
        *((*row, transfer.arrays) for row in WRONG),
        # responses are neither time records nor modes
        ([response(1)], r"holds frequency responses \(data set 58, function type 4\), no time records", readers.arrays),
        ([response(1)], "58, of which 58 are time records or frequency responses", universal_files.arrays),
    ],
)
def test_a_wrong_file_is_refused(written, sets, text, read):
    with pytest.raises(ValueError, match=text) as caught:
        read(written(*sets))
    assert "\n" not in str(caught.value)


def test_the_prompt_lists_peaks_of_a_file(written, prompt):
    said = prompt("frf", written(response(1)), "--out", "h.csv")
    assert said.status == 0 and "100 Hz" in said.out
    assert np.loadtxt("h.csv", delimiter=",", skiprows=1)[:, 1] == pytest.approx(H.real, rel=1e-3, abs=1e-9)
