#!/bin/bash
# Guest script: contactors and inputs on GPIO lines of a chip of the kernel.   usage: gpio_guest.sh MODULE.ko TEST_PROGRAM
# shellcheck source-path=SCRIPTDIR source=guest-env.sh
source "$(dirname "$0")/guest-env.sh"

module=$1 test_program=$2

step "the chip is there"
mount -t debugfs debugfs /sys/kernel/debug
insmod "$module"
expect "/dev/gpiochip0 is a device" test -c /dev/gpiochip0

step "lines on it"
expect "all cases hold" "$test_program" --durations yes --use-colour no
