"""Linear algebra on one thread."""

from collections.abc import Callable
from functools import cache, wraps
from importlib import import_module
from typing import ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController

P = ParamSpec("P")
T = TypeVar("T")


@cache
def _libraries() -> ThreadpoolController:
    import_module("scipy.linalg")  # has a library of its own
    return ThreadpoolController()


def one_thread(function: Callable[P, T]) -> Callable[P, T]:
    """Make a function do its linear algebra on one thread.

    With two, narrow blocks take up to ten times as long, and beside other work a hundred times.
    """

    @wraps(function)
    def alone(*arguments: P.args, **options: P.kwargs) -> T:
        with _libraries().limit(limits=1, user_api="blas"):
            return function(*arguments, **options)

    return alone
