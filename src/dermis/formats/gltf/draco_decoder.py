"""Program that decodes meshes compressed by Draco, see `native_decoding`."""

from __future__ import annotations

import numpy as np

from dermis.base.disk import Arrays
from dermis.base.native_decoding import answer_request


def decode(request: Arrays) -> Arrays:
    """Return the attributes and triangles of compressed meshes.

    For a mesh named "head", the result contains its triangles under the name "head/triangles", and each of
    its attributes under a name such as "head/0", where 0 is the attribute's identifier in the Draco data.

    request : dictionary from the name of each mesh to its compressed bytes
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
