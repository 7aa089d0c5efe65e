"""Compressed bags: what rosbags can undo is read back bit for bit, what it cannot is reported with what to do."""

from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2

from calibration.errors import InputError
from calibration.formats.bag import write
from calibration.formats.bag.read import read_bag
from tests.calibration.formats.test_bag import FIELDS, WRIST, layout, trial

_STORAGE = {"sqlite3": StoragePlugin.SQLITE3, "mcap": StoragePlugin.MCAP}
WRITTEN = {
    "ROS 1 none": ("log.bag", lambda path: Writer1(path)),
    "ROS 1 bz2": ("log.bag", lambda path: _one(path, Writer1.CompressionFormat.BZ2)),
    "ROS 1 lz4": ("log.bag", lambda path: _one(path, Writer1.CompressionFormat.LZ4)),
    "ROS 2 none, sqlite3": ("log", lambda path: _two(path, "sqlite3", CompressionMode.NONE)),
    "ROS 2 file, sqlite3": ("log", lambda path: _two(path, "sqlite3", CompressionMode.FILE)),
    "ROS 2 file, mcap": ("log", lambda path: _two(path, "mcap", CompressionMode.FILE)),
    "ROS 2 message, sqlite3": ("log", lambda path: _two(path, "sqlite3", CompressionMode.MESSAGE)),
    "ROS 2 message, mcap": ("log", lambda path: _two(path, "mcap", CompressionMode.MESSAGE)),
    "ROS 2 chunks, mcap": ("log", lambda path: _two(path, "mcap", CompressionMode.STORAGE)),
}
SMALLER = ("bz2", "lz4", "file", "message", "chunks")


def _one(path, compression):
    bag = Writer1(path)
    bag.set_compression(compression)
    return bag


def _two(path, storage, mode):
    bag = Writer2(path, version=9, storage_plugin=_STORAGE[storage])
    bag.set_compression(mode, CompressionFormat.ZSTD)
    return bag


def written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> Path:
    file, opened = WRITTEN[name]
    tmp_path.mkdir(exist_ok=True)
    monkeypatch.setattr(write, "_writer", lambda path, ros: opened(path))
    write.write_bag(tmp_path / file, trial(), 1 if file == "log.bag" else 2)
    return tmp_path / file


def data_file(path: Path) -> Path:
    return next(p for p in path.iterdir() if p.name != "metadata.yaml") if path.is_dir() else path


@pytest.mark.parametrize("name", WRITTEN)
def test_readings_of_a_compressed_bag_come_back_bit_for_bit(tmp_path, monkeypatch, name):
    path, true = written(tmp_path, monkeypatch, name), trial()
    found = read_bag([path], layout(**WRIST)).joints
    np.testing.assert_array_equal(found.t, true.t_robot)
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(found, field), getattr(true, field))
    if any(word in name for word in SMALLER):  # the library did compress
        plain = written(tmp_path / "plain", monkeypatch, f"{name[:5]} none{', sqlite3' if '2' in name[:5] else ''}")
        assert data_file(path).stat().st_size < data_file(plain).stat().st_size


@pytest.mark.parametrize("name", [n for n in WRITTEN if any(word in n for word in SMALLER)])
def test_a_truncated_compressed_bag_is_reported(tmp_path, monkeypatch, name):
    path = written(tmp_path, monkeypatch, name)
    file = data_file(path)
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    with pytest.raises(InputError, match="cannot be read as a ROS bag .*truncated"):
        read_bag([path], layout(**WRIST))


@pytest.mark.parametrize("name", ["ROS 1 lz4", "ROS 2 file, sqlite3", "ROS 2 chunks, mcap"])
def test_a_compression_nobody_here_can_undo_is_reported_with_the_command_that_does(tmp_path, monkeypatch, name):
    path = written(tmp_path, monkeypatch, name)
    file = path / "metadata.yaml" if "file" in name else data_file(path)
    old, new = (b"compression=lz4", b"compression=xz4") if "lz4" in name else (b"zstd", b"zzzd")
    if "file" in name:
        old, new = b"compression_format: zstd", b"compression_format: lz4"
    text = file.read_bytes()
    assert old in text
    file.write_bytes(text.replace(old, new))
    with pytest.raises(InputError, match="compress.*rosbag decompress.*ros2 bag convert") as caught:
        read_bag([path], layout(**WRIST))
    assert str(path) in str(caught.value) and "truncated" not in str(caught.value)


def test_a_compressed_file_out_of_its_folder_is_reported(tmp_path, monkeypatch):
    path = written(tmp_path, monkeypatch, "ROS 2 file, mcap")
    with pytest.raises(InputError, match="log.mcap.zstd: cannot be read as a ROS bag"):
        read_bag([data_file(path)], layout(**WRIST))


@pytest.mark.parametrize("name", [n for n in WRITTEN if any(word in n for word in SMALLER) and "message" not in n])
def test_a_compressed_bag_with_wrong_bytes_is_reported(tmp_path, monkeypatch, name):
    path = written(tmp_path, monkeypatch, name)
    file = data_file(path)
    content = bytearray(file.read_bytes())
    middle = len(content) // 2
    content[middle : middle + 600] = b"\xff" * 600
    file.write_bytes(bytes(content))
    with pytest.raises(InputError, match="cannot be read as a ROS bag"):
        read_bag([path], layout(**WRIST))


@pytest.mark.parametrize("name", [name for name in WRITTEN if "ROS 1" in name])
def test_a_bag_that_grows_beyond_bounds_is_refused_before_it_does(tmp_path, monkeypatch, name):
    path = written(tmp_path, monkeypatch, name)
    monkeypatch.setattr("calibration.formats.bag.read._ALL_BYTES", 10_000)
    with pytest.raises(InputError, match="too large" if "none" in name else "a chunk of more than 10000 bytes"):
        read_bag([path], layout(**WRIST))
