#!/usr/bin/env bash
# Stands for the command of a queue: takes a job script, runs it in the background, prints the job's name.
nohup bash "$1" >"$1.out" 2>&1 </dev/null &
echo $!
