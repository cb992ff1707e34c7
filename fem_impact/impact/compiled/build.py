"""How the inner loops are compiled, and when compiled ones on disk are still good.

Numba keeps compiled functions on disk and compiles them anew where their own file has changed; it does not notice an
edit in another file that they call into. Here every one carries a stamp of the whole package.

Work that is over before a compiler would be, such as a plan, runs `uncompiled`: there, kernels that are not on disk are
run as plain Python, by a second copy of this package in which nothing is compiled.
"""

import gc
import hashlib
import logging
import os
import pickle
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from functools import cached_property
from importlib import import_module, util
from pathlib import Path
from typing import Any

import numpy as np

from ..._base.progress import LONG
from . import places

LOG = logging.getLogger("fem_impact.slow")
# what numba raises where a file of its cache cannot be read or written, or was cut short
SPOILT = (OSError, EOFError, pickle.UnpicklingError, AttributeError, ImportError, IndexError, KeyError, ValueError)
PLAIN = "plain"  # name of the copy in which nothing is compiled
COMPILED = os.environ.get("NUMBA_DISABLE_JIT", "0") == "0"  # else as plain Python, without the import of numba
COMPILED &= not __name__.endswith(f".{PLAIN}.build")
# [-] most steps of a run as plain Python; 0 where kernels may be compiled, REFUSED where none may that takes LONG
QUICK: ContextVar[float] = ContextVar("QUICK", default=0.0)
REFUSED = -1.0
# [-] runs in plain Python that give up: as many steps all that are still to come may take
ALLOWED: ContextVar[float] = ContextVar("ALLOWED", default=np.inf)
if COMPILED:
    READ_BEFORE = "numba" in sys.modules
    from numba import config, njit
    from numba._dynfunc import make_function
    from numba.core import compiler, event, types
    from numba.core.codegen import JITCodeLibrary
    from numba.core.compiler_lock import global_compiler_lock
    from numba.core.compiler_machinery import register_pass
    from numba.core.options import DefaultOptions
    from numba.core.postproc import PostProcessor, VariableLifetime
    from numba.core.registry import CPUDispatcher
    from numba.core.targetconfig import ConfigStack
    from numba.core.transforms import canonicalize_cfg
    from numba.core.typed_passes import NativeLowering

    if not READ_BEFORE:  # numba takes from a file in the working folder whose compiled code it runs: not for us
        config._config_fname = os.devnull
        config.reload_config()
    places.find(os.environ)
    if places.GIVEN in os.environ:  # numba may have been read before it was found
        config.CACHE_DIR = os.environ[places.GIVEN]  # type: ignore[attr-defined]
    COMPILED = not config.DISABLE_JIT  # type: ignore[attr-defined]  # a file may say so too
    UNCOUNTED = hasattr(DefaultOptions, "_nrt")  # whether the compiler can leave out the counting of references
LOOSE = {"reassoc", "contract"}  # sums may be reordered to run in parallel lanes; NaN and infinity keep their meaning
# No literals: what is called with one is compiled for it and then again.
ZERO, ONE, TRUE, FALSE = np.int64(0), np.int64(1), np.bool_(True), np.bool_(False)


def _stamp() -> str:
    """A digest of every file of this package."""
    files = sorted(Path(__file__).parent.rglob("*.py"))
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()


STAMP = _stamp()


class Uncompiled(Exception):
    """A kernel would have to be compiled: its module, its name and the types of its arguments."""


@contextmanager
def uncompiled(most: float = np.inf, together: float = np.inf) -> Iterator[None]:
    """Compile nothing meanwhile, and let runs give up after ``most`` steps; if REFUSED, raise `Uncompiled`.

    It is raised, too, before a run once those before took as many steps as so many ``together`` that give up.
    """
    tokens = (QUICK, QUICK.set(most)), (ALLOWED, ALLOWED.set(together))
    try:
        yield
    finally:
        for variable, token in tokens:
            variable.reset(token)


def is_limited() -> bool:
    """Whether a run may be plain Python, and therefore must be short."""
    return not COMPILED or QUICK.get() > 0.0


def most_steps(otherwise: int) -> int:
    """Steps after which a run in plain Python gives up, if not after ``otherwise``."""
    return int(min(otherwise, QUICK.get() or otherwise))


def plain(kernel: Any) -> Any:
    """A kernel as plain Python, with all that it calls."""
    if not COMPILED:
        return kernel
    home = __name__.rpartition(".")[0]
    copy = f"{home.rpartition('.')[0]}.{PLAIN}"  # as deep as this package, for imports of what stands before it
    if copy not in sys.modules:
        folder = Path(__file__).parent
        spec = util.spec_from_file_location(copy, folder / "__init__.py", submodule_search_locations=[str(folder)])
        assert spec is not None
        sys.modules[copy] = util.module_from_spec(spec)
    return getattr(import_module(copy + kernel.__module__.removeprefix(home)), kernel.__name__)


if COMPILED:

    class _Kernel(CPUDispatcher):
        """A kernel that runs as plain Python where nothing is to be compiled."""

        def __call__(self, *arguments: Any) -> Any:
            try:
                return super().__call__(*arguments)
            except Uncompiled:
                if QUICK.get() == REFUSED:
                    raise
                return plain(self)(*arguments)

    class _Flags(compiler.Flags):
        """Options of a kernel that are compared quickly: numba does so at each operation, a tenth of its time."""

        @cached_property
        def _known(self) -> tuple[Any, ...]:
            return tuple(sorted((name, str(value)) for name, value in self._values.items()))

        def __hash__(self) -> int:
            return hash(self._known)

        def __eq__(self, other: object) -> bool:
            return self is other or (isinstance(other, _Flags) and self._known == other._known)

    class _PartLibrary(JITCodeLibrary):
        """What is only ever part of kernels becomes machine code with them, not once more by itself."""

        sums = False  # whether sums are reordered, which is decided here, not by what surrounds them in a kernel

        def _optimize_final_module(self) -> None:
            if self.sums:
                super()._optimize_final_module()

        def _finalize_final_module(self) -> None:
            self._finalize_dynamic_globals()
            self._finalized = True

    @register_pass(mutates_CFG=True, analysis_only=False)
    class _Lowering(NativeLowering):
        """The last pass of the compiler, for a part."""

        _name = "lowering_of_a_part"

        def run_pass(self, state: Any) -> bool:
            state.library = _PartLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
            state.library.sums = bool(state.flags.fastmath)
            state.flags.no_compile = True
            super().run_pass(state)
            found = state["cr"]
            name = found.fndesc.qualname
            handle = make_function(found.fndesc.lookup_module(), name, "", 0, found.env, (state.library,))
            state.targetctx.insert_user_function(handle, found.fndesc, [state.library])
            state["cr"] = found._replace(cfunc=handle)
            return True

    class _Parts(compiler.CompilerBase):
        """The passes of the compiler for a part."""

        def define_pipelines(self) -> list[Any]:
            builder = compiler.DefaultPassBuilder.define_nopython_pipeline(self.state)
            builder.passes = [(_Lowering if step is NativeLowering else step, what) for step, what in builder.passes]
            builder.finalize()
            return [builder]

    class _Whole(compiler.CompilerBase):
        """The passes of the compiler for what Python calls: numba's own, also while they are others."""

        define_pipelines = compiler.Compiler.define_pipelines

    DATA = types.Number, types.Boolean, types.Array, types.BaseTuple, types.SliceType

    def _looked_up_once(found: dict[Any, Any], slow: Any) -> Callable[..., Any]:
        """The type of each operation on data."""

        def call_type(self: Any, context: Any, arguments: Any, keywords: Any) -> Any:
            if keywords or not all(isinstance(each, DATA) for each in arguments):
                return slow(self, context, arguments, keywords)
            key = self, tuple(arguments), ConfigStack.top_or_none()
            if key not in found:
                found[key] = slow(self, context, arguments, keywords)
            return found[key]

        return call_type

    def _without_lives(self: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
        """What is done to a function after each pass, without the search for what lives how long until it is used."""
        if emit_dels or self.func_ir.is_generator:
            return PROCESS(self, emit_dels, extend_lifetimes)
        self.func_ir.blocks = canonicalize_cfg(self.func_ir.blocks)
        self.func_ir.variable_lifetime = VariableLifetime(self.func_ir.blocks)
        self.func_ir.generator_info = None
        return None

    PROCESS = PostProcessor.run

    @contextmanager
    def _hastened() -> Iterator[None]:
        """Leave out what the compiler does for nothing, a third of its time and more.

        Types are looked up again and again, lives of variables found after each pass, locks reported; what numba itself
        is made of becomes machine code that is never called; and garbage is collected.
        """
        function: Any = types.BaseFunction
        with global_compiler_lock:
            broadcast, collects = event.broadcast, gc.isenabled()
            swaps: tuple[tuple[Any, str, Any], ...] = (
                (function, "get_call_type", _looked_up_once({}, function.get_call_type)),
                (PostProcessor, "run", _without_lives),
                (compiler.Compiler, "define_pipelines", _Parts.define_pipelines),
                (event, "broadcast", lambda this: None if this.kind == "numba:llvm_lock" else broadcast(this)),
            )
            before = [getattr(owner, name) for owner, name, _ in swaps]
            gc.disable()
            try:
                for owner, name, value in swaps:
                    setattr(owner, name, value)
                yield
            finally:
                for (owner, name, _), value in zip(swaps, before):
                    setattr(owner, name, value)
                if collects:
                    gc.enable()


def _forgiving_call(cache: Any, call: Callable[..., Any]) -> Callable[..., Any]:
    """A call of a cache that forgets what is there, and does nothing, where files are spoilt or forbidden."""

    def tried(*arguments: Any) -> Any:
        try:
            return call(*arguments)
        except SPOILT:
            with suppress(OSError):
                cache.flush()
            return None

    return tried


def outer(allocates: bool = True, seconds: float = 0.0, **options: Any) -> Any:
    """Compile for use from Python; other threads run meanwhile.

    ``allocates`` as for `inner`; ``seconds`` it takes about, which is announced if it is LONG.
    """
    if not COMPILED:
        return lambda function: function
    if UNCOUNTED:
        options["_nrt"] = allocates
    wrapped: dict[str, Any] = {"cache": True, "error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True}
    wrapped["pipeline_class"] = _Whole

    def compiled(function: Any) -> Any:
        kernel = njit(**wrapped, **options)(function)
        # numba has no public ways to do the following; test_build.py tests all in fresh processes
        kernel._cache._cache_file._source_stamp = STAMP
        kernel.__class__ = _Kernel
        kernel._cache.load_overload = _forgiving_call(kernel._cache, kernel._cache.load_overload)
        kernel._cache.save_overload = _forgiving_call(kernel._cache, kernel._cache.save_overload)
        compile_it = kernel._compiler.compile

        def compile_unless_quick(*signature: Any) -> Any:
            if QUICK.get() > 0.0 or (QUICK.get() == REFUSED and seconds > LONG):
                raise Uncompiled(function.__module__, function.__name__, signature[0])
            if seconds > LONG:
                LOG.info("compiling the inner loops of this kind of blow, once: about %g s of computing", seconds)
            with _hastened():
                return compile_it(*signature)

        kernel._compiler.compile = compile_unless_quick
        kernel._compiler._customize_flags = _Flags
        return kernel

    return compiled


def inner(allocates: bool = False, arrays: Any = None, part: bool = False, **options: Any) -> Any:
    """Compile for use by other kernels only; part of them when they are cached, and cheaper to compile.

    What allocates no array needs no count of references, half of the time of a step with few modes. What is called in
    one place, at every step, is compiled as ``part`` of its caller: handing over named tuples of arrays took as long as
    a step with one mode. Where nothing is compiled, ``arrays`` takes the place of the kernel: the same on whole arrays.
    """
    if not COMPILED:
        return lambda function: arrays or function
    bare: dict[str, Any] = {"error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    bare["pipeline_class"] = _Parts
    own = "fastmath" in options  # which would get lost with the function itself
    bare |= {"inline": "always" if part and not own else "never", "forceinline": part and own}
    if UNCOUNTED:
        bare["_nrt"] = allocates  # this and forceinline are said in all cases, as callees inherit them

    def compiled(function: Any) -> Any:
        kernel = njit(**bare, **options)(function)
        kernel._compiler._customize_flags = _Flags
        return kernel

    return compiled


def folder(kernel: Any) -> Path | None:
    """Where a kernel from `outer` is kept on disk; None if it is not compiled."""
    return Path(kernel.stats.cache_path) if COMPILED else None
