"""How functions are compiled by Numba: as wholes that Python calls, and as parts of these.

The code of a *whole* and that of all compiled functions that it calls are linked, optimised and turned into machine
code together, once. A function that other code calls is a *part* of these: it is neither linked nor optimised on its
own, as Numba would do it, which takes several times as long the deeper calls go.

Named tuples that are `lent` to a whole are *borrowed*: Python holds the arrays in them until the whole returns, and
references to them are not counted in between, as Numba would at every call of a part for every array in them. It is
therefore an error to make a named tuple of such a kind in compiled code, or to return one to Python. The arguments of a
part are borrowed, too, until it returns.
"""

from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any, ClassVar, TypeVar

from llvmlite.binding import Linkage  # pyright: ignore[reportMissingTypeStubs]
from numba.core import (  # pyright: ignore[reportMissingTypeStubs]
    codegen,
    compiler,
    compiler_machinery,
    ir,
    lowering,
    registry,
    typed_passes,
    types,
)
from numba.core.runtime.context import NRTContext  # pyright: ignore[reportMissingTypeStubs]

from coverdrive.garbage import not_looking_for_garbage
from coverdrive.locks import alone

T = TypeVar("T")

_Library: Any = codegen.JITCodeLibrary
_Compiler: Any = compiler.Compiler
_Dispatcher: Any = registry.CPUDispatcher
_Counting: Any = NRTContext
_Flags: Any = compiler.Flags
_Lower: Any = lowering.Lower
_Lowering: Any = typed_passes.NativeLowering
_types: Any = types
_OPTIONS = {"nopython": True, "error_model": "numpy", "no_cfunc_wrapper": True}

_lent = set[type]()
"""kinds of named tuples that only Python makes"""
_borrowed = set[Any]()
"""their types to Numba, and those of named tuples in them"""


def lent(kind: type[T]) -> type[T]:
    """A kind of named tuples that compiled code is given by Python, which holds them meanwhile, and never makes."""
    _lent.add(kind)
    return kind


class _PlainLibrary(_Library):
    """Code whose functions are not optimised one by one, as they will be with all others of a whole."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout


class _WholeLibrary(_PlainLibrary):
    """Code that Python calls, to be linked with that of all parts."""

    def add_linking_library(self, library: Any) -> None:
        super().add_linking_library(library)
        if isinstance(library, _PartLibrary):
            for each in library._linking_libraries:
                if each not in self._linking_libraries:
                    self.add_linking_library(each)

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if function.linkage == Linkage.linkonce_odr:  # a part: nobody else calls this copy of it
                function.linkage = "internal"
        super()._optimize_final_module()


class _PartLibrary(_PlainLibrary):
    """Code that other code calls, as it is."""

    def finalize(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


class _Borrowing(_Counting):
    """Counts references, but not those to what is borrowed, except where it comes from Python."""

    def get_meminfos(self, builder: Any, ty: Any, val: Any) -> list[Any]:
        own = builder.module.name != "wrapper"
        return [] if own and ty in _borrowed else super().get_meminfos(builder, ty, val)


class _ArgumentsBorrowed(_Lower):
    """Code that does not count references to its arguments."""

    def lower_assign(self, ty: Any, inst: Any) -> Any:
        value = super().lower_assign(ty, inst)
        if self._is_argument(inst.target.name):
            self.decref(ty, value)
        return value

    def delvar(self, name: str) -> None:
        if not self._is_argument(name):
            super().delvar(name)

    def _is_argument(self, name: str) -> bool:
        """Whether a variable is an argument, and nothing else in between."""
        made = self.func_ir._definitions.get(name, [])
        return len(made) == 1 and isinstance(made[0], ir.Arg)


@compiler_machinery.register_pass(mutates_CFG=True, analysis_only=False)
class _LoweringOfParts(_Lowering):
    _name = "lowering_of_parts"

    @property
    def lowering_class(self) -> Any:
        return _ArgumentsBorrowed


class _SharedFlags(_Flags):
    """Options of the compiler that are one object where they are alike: Numba compares them very often."""

    _known: ClassVar[dict[str, "_SharedFlags"]] = {}

    __hash__ = object.__hash__
    __eq__ = object.__eq__

    def copy(self) -> "_SharedFlags":
        return self._known.setdefault(repr(self), _SharedFlags(self))


class _WholeCompiler(_Compiler):
    def define_pipelines(self) -> Any:
        given = [each for each in self.state.args if getattr(each, "instance_class", None) in _lent]
        _borrowed.update(each for argument in given for each in _named_tuples(argument))
        self._into(_WholeLibrary).enable_object_caching()
        return super().define_pipelines()

    def compile_extra(self, func: Callable[..., Any]) -> Any:
        result = super().compile_extra(func)
        handed = {each.instance_class for each in _borrowed}
        makers = [each for each in self.state.typemap.values() if isinstance(each, _types.NamedTupleClass)]
        returned = [] if self.state.flags.no_compile else list(_named_tuples(self.state.return_type))
        for each in [*makers, *returned]:
            if each.instance_class in handed:
                name = each.instance_class.__name__
                raise TypeError(f"{func.__qualname__} makes a {name} or returns one to Python, which lends them")
        return result

    def _into(self, kind: Any) -> Any:
        """Let what is compiled become a library of a kind."""
        self.state.targetctx.nrt = _Borrowing(self.state.targetctx, True)
        self.state.library = kind(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        return self.state.library


class _PartCompiler(_WholeCompiler):
    def define_pipelines(self) -> Any:
        self._into(_PartLibrary)
        self.state.flags.no_compile = True
        pipelines = _Compiler.define_pipelines(self)
        for each in pipelines:
            each.passes = [(_LoweringOfParts if step is _Lowering else step, why) for step, why in each.passes]
            each.finalize()
        return pipelines


class _Compiled(_Dispatcher):
    """A function that is compiled."""

    def __init__(self, function: Callable[..., Any], compiler: Any, **options: Any):
        super().__init__(function, targetoptions=_OPTIONS | options, pipeline_class=compiler)
        self._compiler._customize_flags = _SharedFlags


class _Part(_Compiled):
    """A function as other code calls it."""

    def get_call_template(self, args: tuple[Any, ...], kws: dict[str, Any]) -> Any:
        return super().get_call_template(tuple(map(_types.unliteral, args)), kws)  # one code for all constants

    def add_overload(self, cres: Any) -> None:
        cres = cres._replace(entry_point=object())  # there is nothing to call, but Numba finds the code by it
        self.targetctx.insert_user_function(cres.entry_point, cres.fndesc, [cres.library])
        self.overloads[tuple(cres.signature.args)] = cres


class Whole(_Compiled):
    """A function as Python calls it."""

    def __init__(self, function: Callable[..., Any]):
        super().__init__(function, _WholeCompiler)

    @cached_property
    def _part(self) -> _Part:
        return _Part(self.py_func, _PartCompiler, no_cpython_wrapper=True)

    @property
    def _numba_type_(self) -> Any:
        """What it is to other code."""
        return _types.Dispatcher(self._part)

    def compile(self, sig: Any) -> Any:
        """Its code for arguments of these types, from the disk if it is kept there."""
        with alone(self.stats.cache_path, wait=True), not_looking_for_garbage():
            return super().compile(sig)


def _named_tuples(kind: Any) -> Iterator[Any]:
    """The types of named tuples in a type."""
    if isinstance(kind, _types.BaseNamedTuple):
        yield kind
    if isinstance(kind, _types.BaseTuple):
        for each in kind:
            yield from _named_tuples(each)
