# Image that renders on the CPU with Mesa's software Vulkan driver (lavapipe), or on an NVIDIA GPU.
#
#     docker build -t dermis .
#     docker run --rm -v "$PWD:/pictures" dermis render -o human.png
#
# A named volume keeps caches between runs: -v dermis-cache:/var/cache/dermis. Files in the current folder are
# read and written as the user 1000; for another user add --user "$(id -u):$(id -g)" -e DERMIS_CACHE=/pictures/.cache.
#
# NVIDIA GPUs: with the NVIDIA container toolkit on the host (1.18 or newer), --gpus all brings the Vulkan part of
# the host's driver into the container; the image requests it by NVIDIA_DRIVER_CAPABILITIES.
#
#     docker run --rm --gpus all -v "$PWD:/pictures" dermis doctor
#
# Debian 12 has the versions of Python and Mesa with which the tests run.
FROM python:3.11-slim-bookworm

# The first two packages are the Vulkan loader and Mesa's drivers; NVIDIA's driver needs the others.
RUN apt-get update \
    && apt-get install -y --no-install-recommends libvulkan1 mesa-vulkan-drivers libegl1 libxext6 \
    && rm -rf /var/lib/apt/lists/*

WORKDIR /source
COPY requirements.lock ./
RUN pip install --no-cache-dir --require-hashes -r requirements.lock

# Extras for commands without a window. pip keeps the installed packages; those that only extras need are the newest.
ARG EXTRAS=batch,formats,video
COPY pyproject.toml README.md LICENSE NOTICE ./
COPY gallery gallery
COPY src src
RUN pip install --no-cache-dir --no-deps --no-build-isolation . \
    && pip install --no-cache-dir "dermis[${EXTRAS}]"

# The cache must be writable for its owner only.
RUN useradd --uid 1000 --create-home dermis \
    && install -d -o dermis -g dermis /pictures \
    && install -d -o dermis -g dermis -m 0700 /var/cache/dermis
ENV DERMIS_CACHE=/var/cache/dermis \
    NVIDIA_DRIVER_CAPABILITIES=graphics,utility
USER 1000
WORKDIR /pictures
ENTRYPOINT ["dermis"]
CMD ["--help"]
