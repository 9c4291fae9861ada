"""A store that was written without an interruption, and stores that are no folders."""

from __future__ import annotations

import logging
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.grid.stores import make


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    store = tmp_path_factory.mktemp("grid") / "whole.zarr"
    make(store)
    return store


# One for all modules, since s3fs keeps connections.
@pytest.fixture(scope="session")
def s3() -> Iterator[str]:
    """The address of a server of S3 on this machine, which has the bucket "grids"."""
    pytest.importorskip("s3fs")
    moto = pytest.importorskip("moto.server")
    logging.getLogger("werkzeug").setLevel(logging.ERROR)
    server = moto.ThreadedMotoServer("127.0.0.1", port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    address = f"http://{host}:{port}"
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("AWS_ENDPOINT_URL", address)
        for name in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"):
            patched.setenv(name, "anything")
        patched.setenv("AWS_DEFAULT_REGION", "us-east-1")
        urllib.request.urlopen(urllib.request.Request(f"{address}/grids", method="PUT")).close()
        yield address
    server.stop()


KINDS = ("memory URL", "MemoryStore", "S3 URL", "ObjectStore")


@pytest.fixture
def elsewhere(request: pytest.FixtureRequest, s3: str) -> Any:
    """A new store of the kind of the test's parameter."""
    zarr = pytest.importorskip("zarr")
    name = f"{request.node.name.translate(str.maketrans('[] ', '___'))}.zarr"
    if request.param.endswith("URL"):
        return f"{request.param.removesuffix(' URL').lower()}://grids/{name}"
    if request.param == "MemoryStore":
        return zarr.storage.MemoryStore()
    obstore = pytest.importorskip("obstore.store")
    plain = {"allow_http": True}
    bucket = obstore.S3Store("grids", prefix=name, endpoint=s3, client_options=plain)
    return zarr.storage.ObjectStore(bucket)
