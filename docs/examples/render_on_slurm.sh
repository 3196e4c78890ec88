#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# render_on_slurm.sh SCENE.xml OUT.exr SAMPLES TASKS [OPTION…]: renders a scene on a cluster with Slurm. An array of
# two or more TASKS renders SAMPLES samples per pixel each, each with its own seed, into OUT.parts/SEED.exr. A job after
# them denoises these together into OUT.exr, and merges them into OUT.mean.exr, the mean of all samples. OPTIONs are
# those of `covary render`. If anything was killed, the same command renders what is missing.
#
# All nodes must see the scene, OUT and covary. Choose partition, time and memory as for any job, with SBATCH_PARTITION,
# SBATCH_TIMELIMIT, SBATCH_MEM_PER_NODE and the other variables of sbatch.
#SBATCH --cpus-per-task=2 --requeue --open-mode=append --signal=B:TERM@60
set -euo pipefail

if [ "${1-}" = --part ]; then  # the job replaces this shell, so that it gets Slurm's signals and keeps its film
  scene=$2 parts=$3 samples=$4
  shift 4
  exec covary render "$scene" -o "$parts/$SLURM_ARRAY_TASK_ID.exr" --estimator none --aovs --spp "$samples" \
    --seed "$SLURM_ARRAY_TASK_ID" --threads "${SLURM_CPUS_PER_TASK:-1}" --resume --no-preview --quiet "$@"
fi
if [ "${1-}" = --join ]; then
  out=$2 parts=("${@:3}")
  covary merge "${parts[@]}" -o "${out%.exr}.mean.exr"
  exec covary denoise "${parts[@]}" -o "$out"
fi

[ $# -ge 4 ] && [ "$4" -ge 2 ] || { sed -n '3,6s/^# //p' "$0" >&2; exit 2; }
command -v sbatch > /dev/null ||
  { echo "$0: no program sbatch here; run this where Slurm takes jobs, mostly the cluster's login node" >&2; exit 1; }
scene=$(realpath "$1") out=$(realpath -m "$2") samples=$3 tasks=$4
shift 4
parts=${out%.exr}.parts
mkdir -p "$parts"
covary render "$scene" --estimator none --spp "$samples" "$@" --replay 0,0,0 > /dev/null  # wrong options end here
array=$(sbatch --parsable --job-name=render --array="1-$tasks" --output="$parts/%a.log" \
  "$0" --part "$scene" "$parts" "$samples" "$@")
mapfile -t films < <(seq -f "$parts/%g.exr" "$tasks")
sbatch --parsable --job-name=join --dependency="afterok:$array" --kill-on-invalid-dep=yes --output="$parts/join.log" \
  "$0" --join "$out" "${films[@]}" > /dev/null
echo "job $array; afterwards $out; messages in $parts"
