#!/usr/bin/perl
# A two-wheeled robot in Perl, written from docs/protocol.md alone: an example of the robot's side of the link, which
# shares no line with twbal. tests/link/conformance tries it as it tries every other robot.
#
#   perl pendulum.pl [clock=lockstep] [seed=0]      clock: lockstep or real_time
#
# It opens a pseudo-terminal, prints "port /dev/pts/N", answers there in version 2, and ends with what started it. The
# robot is an inverted pendulum on wheels that turns on the spot, with the values of the data sheet `paper`. It takes
# torques or voltages, has a linear policy on board, and measures no battery. Needs Linux and core modules of Perl only.
use strict;
use warnings;
use Digest::SHA qw(sha256);
use Encode ();
use Errno qw(EAGAIN EINTR);
use Fcntl;
use POSIX ();
use Time::HiRes qw(clock_gettime CLOCK_MONOTONIC);

use constant {
    VERSION => 2, PERIOD_US => 20_000, TORQUE_LIMIT => 20.0, DIFFERENCE_LIMIT => 10.0, VOLTAGE_LIMIT => 24.0,
    HELLO => 0x01, STOP => 0x04, ARM => 0x05, COMMAND => 0x06, FOLLOW => 0x07,
    WELCOME => 0x81, FAULT => 0x83, POSE_REPORT => 0x84, TELEMETRY => 0x85,
    TORQUE => 0, VOLTAGE => 1, ON_BOARD => 2,
    ARMED => 1, TILT_STOPPED => 2, WATCHDOG_STOPPED => 4, SENSOR_STOPPED => 8, BOARD_DRIVES => 16, HOST_SILENT => 32,
    LIMITED => 64,
    SENSORS => 511,                                       # all but BATTERY, which is 512
    SILENCE_US => 100_000, ON_BOARD_SILENCE_US => 10_000_000, TILT_LIMIT => 0.8, MOST_BYTES => 256, STEP_US => 1000,
};
my $NAN = 'nan' + 0;
my %option = (clock => 'lockstep', seed => 0);
for (@ARGV) {
    /^(?:(clock)=(lockstep|real_time)|(seed)=(\d+))$/
        or die "found '$_', expected clock=lockstep, clock=real_time or seed=<number>\n";
    $option{$1 // $3} = $2 // $4;
}
my $LOCKSTEP = $option{clock} eq 'lockstep';

# ---- Frames: 00, COBS(payload, CRC), 00 ------------------------------------------------------------------------------

sub crc {
    my $crc = 0xFFFF;
    for my $byte (unpack 'C*', $_[0]) {
        $crc ^= $byte << 8;
        $crc = ($crc & 0x8000 ? $crc << 1 ^ 0x1021 : $crc << 1) & 0xFFFF for 1 .. 8;
    }
    return $crc;
}

sub frame {    # of a payload of less than 252 bytes, so that no block of COBS is full
    my ($payload) = @_;
    my @blocks = split /\0/, $payload . pack('v', crc($payload)), -1;
    return "\0" . join('', map { chr(1 + length) . $_ } @blocks) . "\0";
}

sub unframe {    # payload of what was between two zeros; undef: broken
    my ($bytes) = @_;
    return undef if length $bytes > MOST_BYTES;
    my $decoded = '';
    while (length $bytes) {
        my $code = ord $bytes;
        return undef if $code > length $bytes;
        $decoded .= substr $bytes, 1, $code - 1;
        $bytes = substr $bytes, $code;
        $decoded .= "\0" if $code < 255 && length $bytes;
    }
    return undef if length $decoded < 5;
    my $payload = substr $decoded, 0, -2;
    return crc($payload) == unpack('v', substr $decoded, -2) ? $payload : undef;
}

sub is_utf8 { return defined eval { Encode::decode('UTF-8', my $copy = $_[0], Encode::FB_CROAK) } }

sub is_known {    # whether type, length, enumerations and text are those of a message of the protocol
    my ($payload) = @_;
    my $type = ord $payload;
    my %length = (HELLO, 5, STOP, 3, ARM, 8, COMMAND, 11, FOLLOW, 20, POSE_REPORT, 21, TELEMETRY, 66);
    return length $payload >= 3 && is_utf8(substr $payload, 3) if $type == FAULT;
    if ($type == WELCOME) {
        return 0 if length $payload < 5;
        return 1 if unpack('v', substr $payload, 3) != VERSION;
        return length $payload >= 32 && unpack('C', substr $payload, 13) <= 1 && is_utf8(substr $payload, 32);
    }
    return 0 if !$length{$type} || length $payload != $length{$type};
    return $type != ARM || unpack('C', substr $payload, 7) <= ON_BOARD;
}

# ---- Mechanics -------------------------------------------------------------------------------------------------------

my %BODY = (mass => 12 + 2 * 0.0125 / 0.15**2, moment => 3.0, inertia => 0.319 + 10 * 0.3**2, radius => 0.15,
    track => 0.45, yaw_inertia => 0.152 + 2 * (1.0 + 0.0125 / 0.15**2) * 0.225**2);
my %MOTOR = (resistance => 0.5, constant => 0.9);    # ohm; N·m/A at the wheel, gear included
my @GAINS = (10.24, 12.95, 52.6, 9.84, 1.0, 1.5);    # of position, speed, tilt, tilt rate; of heading, yaw rate
my %at;    # position, speed, tilt, tilt_rate, heading, yaw_rate, x, y

sub place {    # puts the robot at rest where a trial begins
    my ($trial) = @_;
    srand(($option{seed} * 1_000_003 + $trial) % 2**32);
    %at = map { $_ => 0 } qw(position speed tilt_rate heading yaw_rate x y);
    $at{tilt} = (-10 + 1.1 * gaussian()) * atan2(1, 1) / 45;
}

sub gaussian { return sqrt(-2 * log(1 - rand)) * cos(8 * atan2(1, 1) * rand) }

sub move {    # by the torques' sum and difference, for a time in seconds
    my ($sum, $difference, $time) = @_;
    my ($sine, $cosine) = (sin $at{tilt}, cos $at{tilt});
    my $along = $sum / $BODY{radius} + $BODY{moment} * $at{tilt_rate}**2 * $sine;
    my $about = $BODY{moment} * 9.81 * $sine - $sum;
    my $coupling = $BODY{moment} * $cosine;
    my $determinant = $BODY{mass} * $BODY{inertia} - $coupling**2;
    $at{speed} += ($BODY{inertia} * $along - $coupling * $about) / $determinant * $time;
    $at{tilt_rate} += ($BODY{mass} * $about - $coupling * $along) / $determinant * $time;
    my $turning = $difference * $BODY{track} / 2 / $BODY{radius} - 0.2 * $at{yaw_rate};
    $at{yaw_rate} += $turning / $BODY{yaw_inertia} * $time;
    $at{$_->[0]} += $at{$_->[1]} * $time for ['position', 'speed'], ['tilt', 'tilt_rate'], ['heading', 'yaw_rate'];
    $at{x} += $at{speed} * cos($at{heading}) * $time;
    $at{y} += $at{speed} * sin($at{heading}) * $time;
    return if abs $at{tilt} < 1.5;
    @at{qw(tilt tilt_rate speed yaw_rate)} = ($at{tilt} < 0 ? -1.5 : 1.5, 0, 0, 0);    # it lies on the floor
}

# ---- The robot's states ----------------------------------------------------------------------------------------------

my $dropped = 0;                               # frames since power-on
my $state = 'strange';                         # strange, off, armed, tripped
my $number = 0;                                # of the last message that was accepted
my $answer = '';                               # to it, as frames
my $refused = 0;                               # whether the answer is a Fault
my $output = '';                               # bytes to be sent
my %run = (time => 0, period => 0, late => 0, stopped => 0, drive => TORQUE, taken => 0, begun => 0);
place(0);
my $power_on = clock_gettime(CLOCK_MONOTONIC);

sub now_us { return $LOCKSTEP ? $run{time} : int(1e6 * (clock_gettime(CLOCK_MONOTONIC) - $power_on)) }

sub send_answer { ($answer, $refused) = ($_[0], 0); $output .= $answer }

sub refusal { return frame(pack('Cv', FAULT, $_[0]) . $_[1]) }

sub fault { send_answer(refusal($number, $_[0])); $refused = 1 }

sub welcome {
    my $policy = unpack 'V', sha256("@GAINS");
    send_answer(frame(pack 'CvvVf<Cf<f<vVVa*', WELCOME, $number, VERSION, PERIOD_US, TORQUE_LIMIT, !$LOCKSTEP,
        DIFFERENCE_LIMIT, VOLTAGE_LIMIT, SENSORS, $policy, 1, 'Perl pendulum'));
}

sub telemetry {
    my $status = $run{stopped};
    if ($state eq 'armed') {
        $status |= ARMED;
        $status |= BOARD_DRIVES if $run{drive} == ON_BOARD;
        $status |= HOST_SILENT if $run{silent};
        $status |= LIMITED if $run{limited};
    }
    my $wheel_rate = $at{speed} / $BODY{radius} - $at{tilt_rate};
    my $apart = $BODY{track} / $BODY{radius};
    my $pose = pack 'Cvvf<4', POSE_REPORT, $number, $run{period} % 2**16, @at{qw(x y heading tilt)};
    my $clock = moves() ? $run{time} : now_us();
    my $sensed = pack 'CvvVCf<12Vvv', TELEMETRY, $number, $run{period} % 2**16, $clock % 2**32, $status,
        $at{tilt} + 1e-4 * gaussian(), $at{tilt_rate} + 1e-3 * gaussian(), $run{acceleration} // 0,
        $at{position} / $BODY{radius} - $at{tilt}, $wheel_rate, $at{heading} * $apart, $at{yaw_rate} * $apart,
        $at{yaw_rate} + 1e-3 * gaussian(), $at{heading}, $NAN, $run{applied} // 0, $run{applied_difference} // 0,
        $run{taken} % 2**32, $run{late} % 2**16, $dropped % 2**16;
    return frame($pose) . frame($sensed);
}

sub clamp { my ($value, $limit) = @_; return $value > $limit ? $limit : $value < -$limit ? -$limit : $value }

sub limit {    # sets sum and difference, cut to what the motors may get
    my ($sum, $difference) = @_;
    my $voltage = $run{drive} == VOLTAGE;
    my $most = $voltage ? 2 * VOLTAGE_LIMIT : TORQUE_LIMIT;
    $run{sum} = clamp($sum, $most);
    my $left = $most - abs $run{sum};
    $left = DIFFERENCE_LIMIT if !$voltage && $left > DIFFERENCE_LIMIT;
    $run{difference} = clamp($difference, $left);
    $run{limited} = $run{sum} != $sum || $run{difference} != $difference;
}

sub decide {    # the policy on board, at the beginning of a period
    return if $state ne 'armed' || $run{drive} != ON_BOARD;
    my ($position, $speed, $heading, $yaw_rate) = @{$run{reference}};
    my $difference = $heading != $heading ? 0
        : $GAINS[4] * ($heading - $at{heading}) + $GAINS[5] * ($yaw_rate - $at{yaw_rate});
    limit($GAINS[0] * ($at{position} - $position) + $GAINS[1] * ($at{speed} - $speed) + $GAINS[2] * $at{tilt}
        + $GAINS[3] * $at{tilt_rate}, $difference);
}

sub begin_period {
    @run{qw(begun speed_before fresh)} = ($run{time}, $at{speed}, 0);
    @run{qw(sum_time difference_time)} = (0, 0);
    decide() if !$LOCKSTEP;
}

sub trip { my ($why) = @_; $state = 'tripped'; $run{stopped} = $why; @run{qw(sum difference)} = (0, 0) }

sub torques {    # of sum and difference, from what drives
    return @run{qw(sum difference)} if $run{drive} != VOLTAGE || $state ne 'armed';
    my $rate = $at{speed} / $BODY{radius} - $at{tilt_rate};
    my $gain = $MOTOR{constant} / $MOTOR{resistance};
    return ($gain * ($run{sum} - 2 * $MOTOR{constant} * $rate),
        $gain * ($run{difference} - $MOTOR{constant} * $at{yaw_rate} * $BODY{track} / $BODY{radius}));
}

sub advance {    # lets the robot move until a time in µs, which lies in the present period
    my ($until) = @_;
    while ($run{time} < $until) {
        my $step = $until - $run{time} < STEP_US ? $until - $run{time} : STEP_US;
        my ($sum, $difference) = @run{qw(sum difference)};
        move(torques(), $step / 1e6);
        $run{sum_time} += $sum * $step;
        $run{difference_time} += $difference * $step;
        $run{time} += $step;
        trip(TILT_STOPPED) if $state eq 'armed' && abs $at{tilt} > TILT_LIMIT;
    }
}

sub end_period {
    advance($run{begun} + PERIOD_US);
    $run{acceleration} = ($at{speed} - $run{speed_before}) * 1e6 / PERIOD_US;
    $run{applied} = $run{sum_time} / PERIOD_US;
    $run{applied_difference} = $run{difference_time} / PERIOD_US;
    $run{period}++;
    $run{late}++ if !$run{fresh} && !$LOCKSTEP;
    if ($LOCKSTEP) { send_answer(telemetry()) } else { $output .= telemetry() }
    begin_period();
}

sub silence_ends {    # µs at which the host has been silent for too long, and what is then done
    return if $LOCKSTEP || $state ne 'armed';
    return ($run{taken} + SILENCE_US, sub { trip(WATCHDOG_STOPPED) }) if $run{drive} != ON_BOARD;
    return ($run{taken} + ON_BOARD_SILENCE_US, sub { trip(WATCHDOG_STOPPED) }) if $run{silent};
    return ($run{taken} + SILENCE_US, sub { $run{silent} = 1; @{$run{reference}}[1, 3] = (0, 0) });
}

sub moves { return $state eq 'armed' || $state eq 'tripped' }

sub pass_time {    # of real time: all that was due until now, in its order
    my ($now) = @_;
    while (moves()) {
        my $end = $run{begun} + PERIOD_US;
        my ($silent, $act) = silence_ends();
        if (defined $silent && $silent <= $now && $silent <= $end) { advance($silent); $act->() }
        elsif ($end <= $now) { end_period() }
        else { advance($now); return }
    }
}

# ---- Messages --------------------------------------------------------------------------------------------------------

sub switch_off { $state = $_[0]; @run{qw(stopped silent limited sum difference)} = (0) x 5 }

sub arm {
    my ($trial, $drive) = @_;
    place($trial);
    my $now = now_us();
    %run = (time => $now, period => 0, late => 0, stopped => 0, drive => $drive, taken => $now, sum => 0,
        difference => 0, reference => [0, 0, $NAN, 0]);
    $state = 'armed';
    trip(TILT_STOPPED) if abs $at{tilt} > TILT_LIMIT;
    send_answer(telemetry());
    begin_period();
}

sub take {    # a Command or Follow
    my ($type, @values) = @_;
    return fault('not armed') if !moves();
    return fault($run{drive} == ON_BOARD ? 'the policy on board drives: expected Follow' : 'expected Command')
        if ($type == FOLLOW) != ($run{drive} == ON_BOARD);
    my @finite = @values;
    splice @finite, 2, 1 if $type == FOLLOW && $values[2] != $values[2];    # a heading may be NaN
    return fault('found a number that is not finite') if grep { $_ - $_ != 0 } @finite;
    if ($state eq 'armed') {
        @run{qw(taken fresh silent)} = (now_us(), 1, 0);
        limit(@values) if $type == COMMAND;
        $run{reference} = \@values if $type == FOLLOW;
    }
    return if !$LOCKSTEP;
    decide();
    end_period();
}

sub obey {    # a new message
    my ($type, $rest) = @_;
    return fault('a message of a robot') if $type >= 0x80;
    return arm(unpack 'VC', $rest) if $type == ARM;
    return take($type, unpack $type == FOLLOW ? 'f<4C' : 'f<2', $rest) if $type != STOP;
    switch_off('off');
    send_answer(telemetry());
}

sub receive {    # what was between two zeros
    my $payload = unframe($_[0]);
    return $dropped++ if !defined $payload || !is_known($payload);
    my ($type, $received, $rest) = unpack 'Cva*', $payload;
    if ($type == HELLO) {
        $number = $received;
        switch_off(unpack('v', $rest) == VERSION ? 'off' : 'strange');
        return welcome();
    }
    return $output .= refusal($received, 'no handshake: expected Hello of version ' . VERSION) if $state eq 'strange';
    my $ahead = ($received - $number) % 2**16;
    return $dropped++ if $ahead > 32767;
    if (!$ahead) { $output .= $answer if $LOCKSTEP || $refused || !moves(); return }
    $number = $received;
    obey($type, $rest);
}

# ---- The port --------------------------------------------------------------------------------------------------------

sub open_terminal {
    sysopen my $master, '/dev/ptmx', O_RDWR | O_NOCTTY | O_NONBLOCK or die "/dev/ptmx: $!\n";
    my ($unlock, $index) = (pack('i', 0), pack('i', 0));
    ioctl $master, 0x40045431, $unlock or die "TIOCSPTLCK: $!\n";
    ioctl $master, 0x80045430, $index or die "TIOCGPTN: $!\n";
    my $termios = POSIX::Termios->new;
    $termios->getattr(fileno $master);
    $termios->setiflag(0);
    $termios->setoflag(0);
    $termios->setlflag(0);
    $termios->setattr(fileno $master, POSIX::TCSANOW());
    return ($master, '/dev/pts/' . unpack 'i', $index);
}

sub wait_us {    # until something is due
    return 1e6 if $LOCKSTEP || !moves();
    my $due = $run{begun} + PERIOD_US;
    my ($silent) = silence_ends();
    $due = $silent if defined $silent && $silent < $due;
    my $wait = $due - now_us();
    return $wait > 0 ? $wait : 0;
}

my ($port, $path) = open_terminal();
$| = 1;
print "port $path\n";
my $input = '';    # bytes of a frame that is not complete
my $parent = getppid;
while (getppid == $parent) {    # it ends with what started it
    vec(my $readable = '', fileno $port, 1) = 1;
    select $readable, undef, undef, wait_us() / 1e6;
    my $length = sysread $port, my $bytes, 4096;
    pass_time(now_us()) if !$LOCKSTEP;
    if (!defined $length && $! != EAGAIN && $! != EINTR) {    # no host has the port open
        switch_off('strange');
        ($input, $output) = ('', '');
        select undef, undef, undef, 0.01;
        next;
    }
    if ($length) {
        my @frames = split /\0/, $input . $bytes, -1;
        $input = pop @frames;
        receive($_) for grep { length } @frames;
        $input = substr $input, 0, MOST_BYTES + 1;
    }
    substr($output, 0, syswrite($port, $output) // length $output) = '' if length $output;
}
