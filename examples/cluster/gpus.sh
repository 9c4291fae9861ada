#!/bin/sh
# One grid on all NVIDIA GPUs of a machine: a part, and a process, for each GPU. The same call again
# renders what is missing.
gpus=$(nvidia-smi --list-gpus | wc -l)
for part in $(seq "$gpus"); do
    CUDA_VISIBLE_DEVICES=$((part - 1)) vkbloom grid picture.exr -o gpus.zarr --adapter hardware \
        --method pyramid --threshold 1 --axis radius=0.5:4:40 --axis intensity=0.02:1:50 \
        --part "$part/$gpus" &
done
wait
