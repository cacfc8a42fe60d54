"""Program that decodes meshes compressed by Draco, see `native_decoding`."""

from __future__ import annotations

import numpy as np

from dermis.base.disk import Arrays
from dermis.base.native_decoding import answer_request


def decode(request: Arrays) -> Arrays:
    """Return the attributes and triangles of compressed meshes.

    An array is called MESH/ATTRIBUTE: the name of the mesh in the request, a slash, and the attribute's
    identifier, or "triangles".
    """
    import DracoPy

    answer = Arrays()
    for name, data in request.items():
        mesh = DracoPy.decode(data.tobytes())
        answer[f"{name}/triangles"] = np.asarray(mesh.faces)
        for attribute in mesh.attributes:
            answer[f"{name}/{attribute['unique_id']}"] = np.asarray(attribute["data"])
    return answer


if __name__ == "__main__":
    answer_request(decode)
