# Reads `avr-size -A` of objects and says what they take of the robot. Constants (.rodata) count
# twice: an AVR cannot read flash like memory, so they are copied to RAM at the start.

function line(name, flash, ram) {
    printf "  %-20s %6d %6d\n", name, flash, ram
}

/:$/ {
    object = $1
    sub(/:$/, "", object)
    sub(/.*\//, "", object)
    names[++objects] = object
}
$1 ~ /^\.(text|progmem)/ { flash[object] += $2 }
$1 ~ /^\.(data|rodata)/ { flash[object] += $2; ram[object] += $2 }
$1 ~ /^\.bss/ { ram[object] += $2 }

END {
    printf "  %-20s %6s %6s\n", "bytes", "flash", "RAM"
    for (i = 1; i <= objects; i++) {
        line(names[i], flash[names[i]], ram[names[i]])
        all_flash += flash[names[i]]
        all_ram += ram[names[i]]
    }
    line("total", all_flash, all_ram)
    line("of", 28160, 2048)
    print "  without kilolib (about 7,000 and 110), the 64-bit arithmetic of libgcc, and the stack"
}
