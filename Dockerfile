# The command, which trains on the processor here, and what `poses` drives: COLMAP, ffmpeg and the converter of HEIC.
#
#   docker build -t pocketsplat .
#   docker run --rm -v "$PWD:/work" pocketsplat train PHOTOS -o scene.psb
#
# Outputs belong to root unless `--user "$(id -u):$(id -g)"` is given too.
FROM rust:1.95-bookworm AS build
COPY . /source
WORKDIR /source
RUN cargo install --locked --path host-trainer/cli --root /installed

FROM debian:bookworm-slim
RUN apt-get update \
    && apt-get install -y --no-install-recommends colmap ffmpeg libheif-examples \
    && rm -rf /var/lib/apt/lists/*
COPY --from=build /installed/bin/pocketsplat /usr/local/bin/
WORKDIR /work
ENTRYPOINT ["pocketsplat"]
