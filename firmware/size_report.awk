# Reads `avr-size -A` of programs and says what they take of the robot: flash (code, the values that
# variables begin with, and the build id: all that the .hex has), RAM at the start (what is left is
# the stack), and the budget that `budget` names. A program beyond its budget, or
# beyond the robot, is marked, and makes the exit code 1; with `strict`, a missing budget does too.

BEGIN {
    # Flash ends where the boot section's last image page does: 220 pages.
    most_flash = 28160
    most_ram = 2048
    while ((getline entry < budget) > 0) {
        if (entry ~ /^#/ || split(entry, field) < 3) continue
        flash_budget[field[1]] = field[2]
        ram_budget[field[1]] = field[3]
    }
}

/:$/ {
    program = $1
    sub(/\.elf:?$/, "", program)
    sub(/.*\//, "", program)
    names[++programs] = program
}
# Variables lie from 0x800000 on, and the values that .data begins with in flash.
$1 == ".text" || $1 == ".data" || ($3 > 0 && $3 < 8388608) { flash[program] += $2 }
$1 == ".data" || $1 == ".bss" || $1 == ".noinit" { ram[program] += $2 }
$1 == ".eeprom" { eeprom[program] = $2 }

END {
    printf "  %-22s %6s %6s   %s\n", "bytes", "flash", "RAM", "budget"
    for (i = 1; i <= programs; i++) {
        program = names[i]
        printf "  %-22s %6d %6d", program, flash[program], ram[program]
        if (program in flash_budget) {
            printf "   %5d %5d", flash_budget[program], ram_budget[program]
            over = flash[program] > flash_budget[program] || ram[program] > ram_budget[program]
        } else {
            over = flash[program] > most_flash || ram[program] > most_ram
            if (strict) printf "   no budget"
            if (strict) failed = 1
        }
        if (eeprom[program]) printf "   %d bytes of .eeprom are left out", eeprom[program]
        print over ? "   TOO LARGE" : ""
        if (over) failed = 1
    }
    printf "  %-22s %6d %6d\n", "the robot has", most_flash, most_ram
    exit failed
}
