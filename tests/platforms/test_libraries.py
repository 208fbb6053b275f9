"""The core's library of every platform, as its loader reads it: what it exports, what it asks of the system, how it computes.

`make test-zips`; of this machine, `make test`. What runs nowhere here (macOS, Windows on arm64) is proven as far as that goes;
test_emulated.py runs the others. Which processor each is for, and what it needs of the system, is asked of all
libraries in the zips alike: test_zips.py.
"""

import importlib.util
import re
from pathlib import Path

import capstone
import lief
import pytest

from hatch_build import PLATFORMS, build_core

LONG = pytest.mark.timeout(3600)
ARM64 = [platform for platform in PLATFORMS if platform.endswith("arm64")]
MACOS = [platform for platform in PLATFORMS if platform.startswith("macos")]
NEWEST_GLIBC = (2, 28)
"""glibc of manylinux_2_28, which is what Blender itself asks for."""
NEWEST_MACOS = (11, 0)
"""macOS of the wheel's tag; Blender 4.2 asks for 11.2."""


def each_of(platforms) -> pytest.MarkDecorator:
    """Runs a test with `platform` as each of these, of those that are left out unless they are asked for."""
    marks = [pytest.mark.platforms, LONG]
    return pytest.mark.parametrize("platform", [pytest.param(platform, marks=marks) for platform in platforms])


@pytest.fixture
def library(platform):
    return lief.parse(build_core(platform, travels=True))


def this_library() -> Path:
    """The core's library that this Python loads."""
    folder = Path(importlib.util.find_spec("viewcam_core").origin).parent
    (library,) = (path for path in folder.iterdir() if path.name != "__init__.py" and path.is_file())
    return library


def exported(library) -> set[str]:
    if isinstance(library, lief.PE.Binary):
        return {entry.name for entry in library.get_export().entries}
    names = {symbol.name for symbol in library.exported_symbols}
    if isinstance(library, lief.MachO.Binary):
        # Zig's linker hides neither its own marks nor operator new and delete, which are weak: the first that a process has
        # loaded serves all its libraries.
        names = {name[1:] for name in names if not re.fullmatch("__(Zn[aw]|Zd[al]).*|__mh_dylib_header|___dso_handle", name)}
    return names


def fused(library) -> list[str]:
    """The instructions of arm64 that multiply and add with one rounding, of float64 or float32."""
    decoder = capstone.Cs(capstone.CS_ARCH_ARM64, capstone.CS_MODE_ARM)
    decoder.skipdata = True
    (text,) = (section for section in library.sections if section.name in (".text", "__text"))
    return [
        mnemonic
        for _, _, mnemonic, _ in decoder.disasm_lite(bytes(text.content), text.virtual_address)
        if re.fullmatch(r"fn?m(add|sub)|fml[as]", mnemonic)
    ]


def thread_storage(binary: lief.ELF.Binary | lief.PE.Binary) -> tuple[int, int]:
    """(bytes, alignment) of the thread_local objects that each thread of the process is given with a library."""
    if isinstance(binary, lief.PE.Binary):
        if not binary.has_tls:
            return 0, 1
        start, end = binary.tls.addressof_raw_data
        # IMAGE_SCN_ALIGN_*: bits 20 to 23 hold one more than the logarithm.
        return end - start + binary.tls.sizeof_zero_fill, 1 << max((binary.tls.characteristics >> 20 & 15) - 1, 0)
    (segment,) = [s for s in binary.segments if s.type == lief.ELF.Segment.TYPE.TLS] or [None]
    return (segment.virtual_size, segment.alignment) if segment else (0, 1)


@each_of(PLATFORMS)
def test_it_exports_its_one_function(library):
    assert exported(library) == {"viewcam_core"}


@each_of(MACOS)
def test_macos_libraries_are_named_without_the_folder_of_whoever_built_them(library):
    (name,) = (each.name for each in library.libraries if each.command == lief.MachO.LoadCommand.TYPE.ID_DYLIB)
    assert name == "@rpath/libviewcam.dylib"


@each_of(PLATFORMS)
def test_it_runs_on_the_oldest_system_that_its_wheel_is_tagged_for(platform, library):
    if platform.startswith("linux"):
        names = [version.name for need in library.symbols_version_requirement for version in need.get_auxiliary_symbols()]
        versions = [tuple(map(int, name.removeprefix("GLIBC_").split("."))) for name in names if name.startswith("GLIBC_")]
        assert versions and max(versions)[:2] <= NEWEST_GLIBC, f"it needs glibc {max(versions)}"
        assert all(name.startswith("GLIBC_") for name in names), names
    elif platform.startswith("macos"):
        command = library.build_version or library.version_min
        assert tuple((command.minos if library.build_version else command.version)[:2]) <= NEWEST_MACOS
    else:
        assert library.optional_header.major_subsystem_version <= 6


@pytest.mark.platforms
@LONG
def test_no_product_is_rounded_together_with_its_sum_but_where_the_source_says_so():
    """-ffp-contract=off: pictures' bits, and the triangle test, stand on it.

    With std::fma as a call, clang's fmod(x, 2) = x − 2 trunc(x/2) is left, whose product is exact (nodes/math.h).
    """
    assert len(fused(lief.parse(build_core("linux-arm64", ("-fno-builtin-fma",), travels=True)))) <= 2


@pytest.mark.platforms
@LONG
def test_without_ffp_contract_off_thousands_would_be():
    assert len(fused(lief.parse(build_core("linux-arm64", ("-ffp-contract=fast",), travels=True)))) > 1000


@each_of(ARM64)
def test_arm64_s_libraries_fuse_as_much_as_linux_does(library):
    """Compilers may inline std::fma in other places, a little: calibrated, 40 on Linux."""
    assert len(fused(library)) < 200


@each_of(platform for platform in PLATFORMS if platform not in MACOS)
def test_no_thread_local_object_asks_for_more_than_malloc_aligns_to(library):
    """macOS allocates thread storage when it is asked for, by what its type needs."""
    assert thread_storage(library)[1] <= 16


def test_no_thread_local_object_of_this_machine_s_core_asks_for_more_than_malloc_aligns_to():
    """wine 8's loader and that of Windows before 8.1 place thread storage at 16 bytes, whatever it asks for."""
    size, alignment = thread_storage(lief.parse(this_library()))
    assert alignment <= 16, f"{alignment} bytes"
    assert 0 < size <= 4096, f"every thread of Blender is given {size} bytes"
