#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# frames_on_slurm.sh SCENE.xml OUT_####.exr FIRST-LAST [WAVESx]SAMPLES [OPTION…]: renders a sequence on a cluster with
# Slurm. An array has a task for each wave of each frame, which renders SAMPLES samples per pixel (in four groups if
# there is only one wave) into OUT_.parts/FRAME-WAVE.exr with its own seed. A job after them denoises the frames one
# after the other, each with the history of the previous frame. OPTIONs are those of `covary render`, such as
# --camera-path. If anything was killed, the same command renders what is missing.
#
# All nodes must see the scene, the camera path, OUT and covary. Choose partition, time and memory as for any job, with
# SBATCH_PARTITION, SBATCH_TIMELIMIT, SBATCH_MEM_PER_NODE and the other variables of sbatch.
#SBATCH --cpus-per-task=2 --requeue --open-mode=append --signal=B:TERM@60
set -euo pipefail

if [ "${1-}" = --part ]; then  # the job replaces this shell, so that it gets Slurm's signals and keeps its film
  scene=$2 parts=$3 waves=$4 samples=$5 wave=$((SLURM_ARRAY_TASK_ID % $4))
  shift 5
  [ "$waves" -gt 1 ] || set -- --groups 4 "$@"
  exec covary render "$scene" -o "$parts/#-$((wave + 1)).exr" --frames $((SLURM_ARRAY_TASK_ID / waves)) --seed $wave \
    --estimator none --aovs --spp "$samples" --threads "${SLURM_CPUS_PER_TASK:-1}" --resume --no-preview --quiet "$@"
fi
if [ "${1-}" = --join ]; then
  mapfile -t films < <(seq -f "$2/#-%.0f.exr" "$5")
  exec covary denoise "${films[@]}" -o "$3" --frames "$4"
fi

[ $# -ge 4 ] && [[ $2 = *#* && $3 = *-* ]] || { sed -n '3,7s/^# //p' "$0" >&2; exit 2; }
command -v sbatch > /dev/null ||
  { echo "$0: no program sbatch here; run this where Slurm takes jobs, mostly the cluster's login node" >&2; exit 1; }
scene=$(realpath "$1") out=$(realpath -m "$2") frames=$3 samples=${4##*x} waves=1
[[ $4 != *x* ]] || waves=${4%%x*}
shift 4
parts=${out%.exr} parts=${parts//#/}.parts
mkdir -p "$parts"
covary render "$scene" --estimator none --groups 4 --spp "$samples" "$@" --frames "${frames%%-*}" --replay 0,0,0 \
  > /dev/null  # wrong options end here
tasks=$((${frames%-*} * waves))-$((${frames#*-} * waves + waves - 1))
array=$(sbatch --parsable --job-name=frames --array="$tasks" --output="$parts/%a.log" \
  "$0" --part "$scene" "$parts" "$waves" "$samples" "$@")
sbatch --parsable --job-name=join --dependency="afterok:$array" --kill-on-invalid-dep=yes --output="$parts/join.log" \
  "$0" --join "$parts" "$out" "$frames" "$waves" > /dev/null
echo "job $array; afterwards $out; messages in $parts"
