# The first stage builds with the packages of scripts/setup. The second has the program, the examples, and what the program runs with.
FROM debian:12 AS build
RUN apt-get update && apt-get install -y --no-install-recommends ca-certificates curl
RUN curl --proto '=https' --tlsv1.2 -sSf https://static.rust-lang.org/rustup/rustup-init.sh -o /tmp/rustup \
 && sh /tmp/rustup -y --profile minimal
ENV PATH=/root/.cargo/bin:$PATH
WORKDIR /opt/winkler
# Packages come before the source, so that a change of the source does not install them again.
COPY Cargo.toml ./
COPY scripts/setup scripts/
RUN scripts/setup
COPY . .
RUN cargo install --path . --locked --root /usr/local

FROM debian:12
# The libraries of the packages with headers that scripts/setup installs.
RUN apt-get update && apt-get install -y --no-install-recommends \
    libpetsc-real3.18 libmumps-5.5 libmetis5 libopenblas0-pthread openmpi-bin gmsh \
 && rm -rf /var/lib/apt/lists/*
COPY --from=build /usr/local/bin/winkler /usr/local/bin/
COPY --from=build /opt/winkler/meshes /opt/winkler/meshes
ENV OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
ENTRYPOINT ["winkler"]
