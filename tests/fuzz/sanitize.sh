#!/bin/sh
# As `instrument.sh`, under AddressSanitizer. By another name, since cargo tells builds apart by it.
SANITIZE=address exec "$(dirname "$0")/instrument.sh" "$@"
