"""Operations on addresses for compiled loops: pointers, calls of C functions, copies."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core.cgutils import raw_memcpy, voidptr_t
from numba.extending import intrinsic


def _pointer(typing: Any, address: Any) -> Any:
    def build(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.inttoptr(args[0], voidptr_t)

    return types.voidptr(types.int64), build


def _call(typing: Any, function: Any, model: Any, data: Any) -> Any:
    """Call ``void function(void*, void*)`` by its address, so the caller stays cacheable."""

    def build(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        kind = ir.FunctionType(ir.VoidType(), [voidptr_t, voidptr_t])
        function = builder.inttoptr(args[0], kind.as_pointer())
        builder.call(function, [builder.inttoptr(address, voidptr_t) for address in args[1:]])
        return context.get_dummy_value()

    return types.none(types.int64, types.int64, types.int64), build


def _call_with(typing: Any, function: Any, model: Any, data: Any, third: Any) -> Any:
    """Call ``int function(void*, void*, void*)`` by its address."""

    def build(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        kind = ir.FunctionType(ir.IntType(32), [voidptr_t, voidptr_t, voidptr_t])
        function = builder.inttoptr(args[0], kind.as_pointer())
        return builder.call(
            function, [builder.inttoptr(address, voidptr_t) for address in args[1:]]
        )

    return types.int32(types.int64, types.int64, types.int64, types.int64), build


def _copy(typing: Any, to: Any, source: Any, words: Any) -> Any:
    def build(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        to, source = (builder.inttoptr(address, voidptr_t) for address in args[:2])
        raw_memcpy(builder, to, source, args[2], 8, align=8)
        return context.get_dummy_value()

    return types.none(types.int64, types.int64, types.int64), build


pointer = intrinsic(_pointer)
call = intrinsic(_call)
call_with = intrinsic(_call_with)
copy_words = intrinsic(_copy)
