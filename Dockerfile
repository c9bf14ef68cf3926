# The service in a container. It binds every address, so it starts only with RIDGEWAVE_API_KEYS set:
#
#     docker build -t ridgewave .
#     docker run -p 8000:8000 -e RIDGEWAVE_API_KEYS=choose-a-long-key ridgewave
#
# Any user and a read-only file system work, since the compiled kernels are in the image (docs/operations.md):
#
#     docker run --read-only --tmpfs /tmp --user 12345:12345 -p 8000:8000 -e RIDGEWAVE_API_KEYS=... ridgewave
#
# Other commands work too: docker run -v "$PWD:/sound" ridgewave render grating-1mm-31um -o /sound/out.wav

ARG PYTHON=3.11-slim-bookworm

# Only npm, for three.js of the VR page: hatch_build.py fetches it while the package is built.
FROM node:22-bookworm-slim AS node


FROM python:${PYTHON} AS build
ENV PIP_NO_CACHE_DIR=1 PIP_DISABLE_PIP_VERSION_CHECK=1
WORKDIR /build
COPY --from=node /usr/local/bin/node /usr/local/bin/node
COPY --from=node /usr/local/lib/node_modules/npm /usr/local/lib/node_modules/npm
RUN ln -s ../lib/node_modules/npm/bin/npm-cli.js /usr/local/bin/npm
COPY pyproject.toml constraints.txt hatch_build.py README.md LICENSE ./
COPY ridgewave ridgewave
COPY synth synth
COPY service service
COPY clients clients
RUN python3 -m venv /opt/ridgewave && /opt/ridgewave/bin/pip install -c constraints.txt .


FROM python:${PYTHON}
# Debian keeps one version of a package at a time, so naming it would only break the build later.
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install -y --no-install-recommends libportaudio2 \
    && rm -rf /var/lib/apt/lists/* \
    && useradd --create-home --uid 10001 ridgewave
COPY --from=build /opt/ridgewave /opt/ridgewave
COPY docs/examples /opt/ridgewave/examples
ENV PATH=/opt/ridgewave/bin:$PATH \
    NUMBA_CACHE_DIR=/var/cache/ridgewave \
    PYTHONUNBUFFERED=1
RUN install -d -o ridgewave -g ridgewave /var/cache/ridgewave
USER 10001:10001
WORKDIR /home/ridgewave

# One render of every example, and of one with each effect, and live voices of each quantity and effect compile the kernels
# into the image. numba compiles again, once, on another kind of CPU.
RUN for scene in /opt/ridgewave/examples/*.json; do \
        ridgewave render "$scene" --duration 0.1 -o /tmp/warm.wav || exit 1; \
    done \
    && for effect in $(python -c 'from synth.scene.effects_section import effect_names as names; print(*names())'); do \
        ridgewave render /opt/ridgewave/examples/paper-finger.json --duration 0.1 --set "effects.$effect={}" \
            -o /tmp/warm.wav || exit 1; \
    done \
    && python -c 'from service.synth_engine import SynthEngine; \
from service.lifespan import open_live_voices as compiled; \
from synth.scene.effects_section import effect_names; engine = SynthEngine(0); \
[compiled(engine, {"output": {"quantity": name}}) for name in ("displacement", "velocity", "acceleration")]; \
[compiled(engine, {"effects": {name: {}}}) for name in effect_names()]' \
    && rm /tmp/warm.wav

# Any answer below 500 is a sign of life: with RIDGEWAVE_ALLOWED_HOSTS set, the service may refuse this Host.
ENV RIDGEWAVE_HOST=0.0.0.0 RIDGEWAVE_PORT=8000
EXPOSE 8000
HEALTHCHECK --interval=10s --timeout=3s --start-period=20s CMD ["python", "-c", "import http.client, os, sys; \
service = http.client.HTTPConnection('127.0.0.1', int(os.environ['RIDGEWAVE_PORT']), timeout=2); \
service.request('GET', '/healthz'); sys.exit(service.getresponse().status >= 500)"]
ENTRYPOINT ["ridgewave"]
CMD ["serve"]
