# docker build -t artsim . && docker run --rm -v "$PWD/out:/data/out" artsim artperl demo
# For a CPU build of torch, a tenth of the default one, pip's own settings say where it is:
# docker build --secret id=pip,src=pip.conf -t artsim .
FROM python:3.11-slim
WORKDIR /opt/artsim
COPY . .
RUN --mount=type=secret,id=pip,target=/etc/pip.conf pip install --no-cache-dir -c constraints.txt '.[view,train,sim]'
# Renderers of extras need more: scripts/install-system.sh, scripts/install-vulkan.sh.
RUN useradd --create-home user && mkdir /data && chown user /data
USER user
WORKDIR /data
CMD ["artsim", "doctor"]
