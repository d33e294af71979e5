# docker build -t artsim . && docker run --rm -v "$PWD/out:/work/out" artsim artperl demo
FROM python:3.11-slim
WORKDIR /opt/artsim
COPY . .
# A CPU build of torch, a tenth of the default one: put its wheel into wheels/, or give an index in TORCH.
ARG TORCH=""
RUN mkdir -p wheels \
    && pip install --no-cache-dir -c constraints.txt --find-links wheels $TORCH '.[view,train,sim]'
# Renderers of extras need more: scripts/install-system.sh, scripts/install-vulkan.sh.
RUN useradd --create-home user && mkdir /work && chown user /work
USER user
WORKDIR /work
CMD ["artsim", "doctor"]
