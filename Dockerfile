# docker build -t seixo .
# docker run --rm -u "$(id -u):$(id -g)" -v "$PWD:/work" seixo run case.toml
#
# With a GPU of its own driver: add what your container runtime asks for (`--gpus all`, or `--device /dev/dri`); without one
# the CPU path runs, and `--backend gpu` takes Mesa's software Vulkan.
FROM rust:1-slim-trixie AS build
WORKDIR /src
COPY . .
# The image's own toolchain, not the one that rust-toolchain.toml would fetch.
RUN rm rust-toolchain.toml && cargo build --release --locked -p seixo-cli

FROM debian:trixie-slim
RUN apt-get update \
    && apt-get install -y --no-install-recommends libvulkan1 mesa-vulkan-drivers \
    && rm -rf /var/lib/apt/lists/*
COPY --from=build /src/target/release/seixo /usr/local/bin/seixo
WORKDIR /work
ENTRYPOINT ["seixo"]
