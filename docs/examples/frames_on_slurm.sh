#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# frames_on_slurm.sh SCENE.xml OUT_####.exr FIRST-LAST SAMPLES [OPTION…]: renders a sequence on a cluster with Slurm. An
# array has a task for each frame, which renders SAMPLES samples per pixel in four groups into OUT_.parts/FRAME.exr. A
# job after them denoises these one after the other, each with the history of the frame before. OPTIONs are those of
# `covary render`, such as --camera-path. The same command again, after anything was killed, renders what is missing.
#
# Scene, camera path, OUT and covary must be where all nodes see them. Partition, time and memory are chosen as for any
# job, by SBATCH_PARTITION, SBATCH_TIMELIMIT, SBATCH_MEM_PER_NODE and the other variables of sbatch.
#SBATCH --cpus-per-task=2 --requeue --open-mode=append --signal=B:TERM@60
set -euo pipefail

if [ "${1-}" = --part ]; then  # the job replaces this shell, so that it gets Slurm's signals and keeps its film
  scene=$2 parts=$3 samples=$4
  shift 4
  exec covary render "$scene" -o "$parts/#.exr" --frames "$SLURM_ARRAY_TASK_ID" --estimator none --groups 4 --aovs \
    --spp "$samples" --threads "${SLURM_CPUS_PER_TASK:-1}" --resume --no-preview --quiet "$@"
fi
if [ "${1-}" = --join ]; then
  exec covary denoise "$2/#.exr" -o "$3" --frames "$4"
fi

[ $# -ge 4 ] && [[ $2 = *#* && $3 = *-* ]] || { sed -n '3,6s/^# //p' "$0" >&2; exit 2; }
scene=$(realpath "$1") out=$(realpath -m "$2") frames=$3 samples=$4
shift 4
parts=${out%.exr} parts=${parts//#/}.parts
mkdir -p "$parts"
covary render "$scene" --estimator none --groups 4 --spp "$samples" "$@" --frames "${frames%%-*}" --replay 0,0,0 \
  > /dev/null  # wrong options end here
array=$(sbatch --parsable --job-name=frames --array="$frames" --output="$parts/%a.log" \
  "$0" --part "$scene" "$parts" "$samples" "$@")
sbatch --parsable --job-name=join --dependency="afterok:$array" --kill-on-invalid-dep=yes --output="$parts/join.log" \
  "$0" --join "$parts" "$out" "$frames" > /dev/null
echo "job $array; afterwards $out; messages in $parts"
