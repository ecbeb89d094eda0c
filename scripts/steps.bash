# For the scripts beside: one line per step, the whole output when a step fails.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# Test programs of the core (motion, camera, depth, pose), in build/*/test.
core_tests=(motion/motion_test camera/camera_test pose/pose_test
            depth/{depth,unknown_motion,focal,window,filter,noise_learner,robot_errors}_test)

step_log=$(mktemp)
trap 'rm -f "$step_log"' EXIT

# step <what> <command>...: runs the command; its output stays in $step_log.
step() {
  local what=$1 start=$SECONDS code=0
  shift
  printf '%s ... ' "$what"
  "$@" > "$step_log" 2>&1 || code=$?
  if [[ $code -ne 0 ]]; then
    printf 'failed\n'
    cat "$step_log"
    exit "$code"
  fi
  printf '%d s\n' $((SECONDS - start))
}
