#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# What became of a job, in the words of Snakemake: running, success or failed.
#
# usage: status.sh JOB
job=${1%%;*}  # sbatch adds the name of the cluster where there are several
known=$(LC_ALL=C scontrol show job --oneliner "$job" 2>&1)
case "$known" in
  *JobState=*) state=$(echo "$known" | sed 's/.*JobState=\([A-Z_]*\).*/\1/') ;;
  *"Invalid job id"*)
    # Forgotten some minutes after its end; where nobody keeps accounts, the job is asked for again, and
    # its run finds what is done.
    state=$(sacct -X -n -P -o State -j "$job" 2>/dev/null | head -n 1) ;;
  *) state=UNKNOWN ;;  # no answer now
esac
case "$state" in
  COMPLETED) echo success ;;
  PENDING | CONFIGURING | RUNNING | COMPLETING | SUSPENDED | STOPPED | SIGNALING | STAGE_OUT | RESIZING | \
    REQUEUED | REQUEUE_FED | REQUEUE_HOLD | RESV_DEL_HOLD | SPECIAL_EXIT | UNKNOWN) echo running ;;
  *) echo failed ;;
esac
