"""The core's library of every platform, as its loader reads it: what it asks of the system, what it exports, how it computes.

`make test-zips`. What can't be run here (macOS, Windows on arm64) is proven as far as that goes; test_arm64.py and
test_windows.py run the others.
"""

import re
import sys
from pathlib import Path

import capstone
import lief
import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT), str(Path(__file__).parent)]
from test_core_library import thread_storage

from hatch_build import PLATFORMS, build_core

pytestmark = [pytest.mark.platforms, pytest.mark.timeout(3600)]

ARM64 = [platform for platform in PLATFORMS if platform.endswith("arm64")]
GLIBC = (2, 28)
"""glibc of manylinux_2_28, which is what Blender itself asks for."""
MACOS = (11, 0)
"""macOS of the wheel's tag; Blender 4.2 asks for 11.2."""
SYSTEM = {
    "linux": r"lib(c|m|pthread|dl|rt)\.so\.\d|ld-linux-.*\.so\.\d",
    "macos": r"/usr/lib/libSystem\.B\.dylib|/usr/lib/libc\+\+\.1\.dylib",
    "windows": r"(?i:kernel32|ntdll|advapi32|api-ms-win-crt-.*)\.dll",
}
"""Names of libraries that every machine of a system has."""


@pytest.fixture(params=PLATFORMS)
def platform(request) -> str:
    return request.param


@pytest.fixture
def library(platform):
    return lief.parse(build_core(platform, travels=True))


def needed(library) -> list[str]:
    """The names of the libraries that it needs; of macOS' list the first is its own."""
    if isinstance(library, lief.MachO.Binary):
        return [each.name for each in library.libraries if each.command != lief.MachO.LoadCommand.TYPE.ID_DYLIB]
    return [str(getattr(each, "name", each)) for each in library.libraries]


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


def test_it_needs_nothing_that_a_machine_may_lack(platform, library):
    allowed = SYSTEM[platform.partition("-")[0]]
    missing = [name for name in needed(library) if not re.fullmatch(allowed, name)]
    assert not missing, f"it needs {missing}"


def test_it_exports_its_one_function(library):
    assert exported(library) == {"viewcam_core"}


@pytest.mark.parametrize("platform", [platform for platform in PLATFORMS if platform.startswith("macos")])
def test_macos_libraries_are_named_without_the_folder_of_whoever_built_them(library):
    (name,) = (each.name for each in library.libraries if each.command == lief.MachO.LoadCommand.TYPE.ID_DYLIB)
    assert name == "@rpath/libviewcam.dylib"


def test_it_runs_on_the_oldest_system_that_its_wheel_is_tagged_for(platform, library):
    if platform.startswith("linux"):
        names = [version.name for need in library.symbols_version_requirement for version in need.get_auxiliary_symbols()]
        versions = [tuple(map(int, name.removeprefix("GLIBC_").split("."))) for name in names if name.startswith("GLIBC_")]
        assert versions and max(versions)[:2] <= GLIBC, f"it needs glibc {max(versions)}"
        assert all(name.startswith("GLIBC_") for name in names), names
    elif platform.startswith("macos"):
        command = library.build_version or library.version_min
        assert tuple((command.minos if library.build_version else command.version)[:2]) <= MACOS
    else:
        assert library.optional_header.major_subsystem_version <= 6


def test_it_is_for_the_processor_that_its_platform_names(platform, library):
    processors = {"ELF": "machine_type", "PE": "machine", "MachO": "cpu_type"}
    name = getattr(library.header, processors[type(library).__module__.rpartition(".")[2]]).name
    assert re.fullmatch("ARM64|AARCH64" if platform.endswith("arm64") else "X86_64|AMD64", name.upper()), name


def test_no_product_is_rounded_together_with_its_sum_but_where_the_source_says_so():
    """-ffp-contract=off: pictures' bits, and the triangle test, stand on it.

    With std::fma as a call, clang's fmod(x, 2) = x − 2 trunc(x/2) is left, whose product is exact (nodes/math.h).
    """
    assert len(fused(lief.parse(build_core("linux-arm64", ("-fno-builtin-fma",), travels=True)))) <= 2


def test_without_ffp_contract_off_thousands_would_be():
    assert len(fused(lief.parse(build_core("linux-arm64", ("-ffp-contract=fast",), travels=True)))) > 1000


@pytest.mark.parametrize("platform", ARM64)
def test_arm64_s_libraries_fuse_as_much_as_linux_does(library):
    """Compilers may inline std::fma in other places, a little: calibrated, 40 on Linux."""
    assert len(fused(library)) < 200


@pytest.mark.parametrize("platform", [platform for platform in PLATFORMS if not platform.startswith("macos")])
def test_no_thread_local_object_asks_for_more_than_malloc_aligns_to(library):
    """macOS allocates thread storage when it is asked for, by what its type needs."""
    assert thread_storage(library)[1] <= 16
