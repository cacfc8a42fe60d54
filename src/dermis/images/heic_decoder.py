"""Program that decodes HEIC pictures, see `native_decoding`."""

from __future__ import annotations

import io

import numpy as np

from dermis.base.disk import Arrays
from dermis.base.native_decoding import answer_request
from dermis.images.sizes import MAX_PIXELS


def decode(request: Arrays) -> Arrays:
    """Return the size, ICC profile, properties and pixels of a HEIC picture.

    The properties are the bits per channel in the file, whether the picture was turned upright, and whether
    the file contains further pictures. The pixels of a picture that is too large are left out.

    request : arrays with the bytes of the file as "data"
    """
    import pi_heif

    picture = pi_heif.HeifImageFile(io.BytesIO(request["data"].tobytes()))
    turned = picture.info.get("original_orientation") not in (None, 1)
    profile = np.frombuffer(picture.info.get("icc_profile") or b"", np.uint8)
    facts = np.array([picture.info["bit_depth"], turned, picture.n_frames > 1])
    answer = Arrays(size=np.array(picture.size), profile=profile, facts=facts)
    if picture.width * picture.height <= MAX_PIXELS:
        answer["pixels"] = np.asarray(picture)
    return answer


if __name__ == "__main__":
    answer_request(decode)
