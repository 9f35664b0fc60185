import os
import pty
import re
import select
import signal
import socket
import subprocess
import sys
import threading
import time
import tty
from contextlib import suppress
from pathlib import Path

import pytest
from hydra.utils import instantiate
from omegaconf import OmegaConf
from pendulum import Pendulum

from twbal.core.errors import ConfigError, LinkError, LinkLostError
from twbal.link import transport
from twbal.link.protocol import Clock
from twbal.link.serial_plant import SerialPlant
from twbal.link.transport import SerialTransport
from twbal.virtual_robot.firmware import Firmware, Identity

CONF = Path(__file__).parents[2] / "conf"


@pytest.fixture
def port():
    """Both ends of a pseudo-terminal: the far end's file, and the path of the near one."""
    far, near = pty.openpty()
    tty.setraw(near)
    path = os.ttyname(near)
    os.close(near)
    yield far, path
    os.close(far)


def test_a_port_that_is_not_there_is_an_error_that_lists_those_that_are():
    with pytest.raises(LinkError, match=r"/dev/no_such_port.*Serial ports that are there: \S+"):
        SerialTransport("/dev/no_such_port", 115200)


@pytest.mark.parametrize("path", ["/dev/null", "/etc/hostname", __file__, "/"])
def test_what_is_no_serial_port_is_called_so(path):
    with pytest.raises(LinkError, match=rf"^{re.escape(path)} is no serial port\. Serial ports that are there: "):
        SerialTransport(path, 115200)


@pytest.mark.parametrize("baud_rate", [0, -1])
def test_a_baud_rate_that_is_none_is_refused_and_named(port, baud_rate):
    with pytest.raises(ConfigError, match=rf"link\.baud_rate must be positive.* found {baud_rate}"):
        SerialTransport(port[1], baud_rate)


def test_a_baud_rate_beyond_any_is_one_error(port):
    with pytest.raises(LinkError, match=r"Cannot open the port .* greater than maximum"):
        SerialTransport(port[1], 10**12)


def test_an_unknown_kind_of_url_is_an_error():
    with pytest.raises(LinkError, match="carrier_pigeon://loft"):
        SerialTransport("carrier_pigeon://loft", 115200)


def test_bytes_pass_unchanged_both_ways(port):
    far, path = port
    line = SerialTransport(path, 921600)
    every_byte = bytes(range(256))
    line.write(every_byte)
    assert os.read(far, 1000) == every_byte
    os.write(far, every_byte)
    got = b""
    while len(got) < 256:
        got += line.read()
    assert got == every_byte
    line.close()


def test_silence_is_empty_and_a_pseudo_terminal_without_low_latency_is_tolerated(port):
    line = SerialTransport(port[1], 115200)
    assert line.read() == b""
    line.close()


def test_a_port_serves_one_host_at_a_time(port):
    line = SerialTransport(port[1], 115200)
    with pytest.raises(LinkError, match=r"Cannot open the port \S+: another program has it open"):
        SerialTransport(port[1], 115200)
    line.close()
    SerialTransport(port[1], 115200).close()


def test_a_port_that_is_pulled_out_is_a_lost_link():
    far, near = pty.openpty()
    line = SerialTransport(os.ttyname(near), 115200)
    os.close(near)
    os.close(far)
    with pytest.raises(LinkLostError, match="gone while reading"):
        line.read()
    with pytest.raises(LinkLostError, match="gone while writing"):
        line.write(b"x")
    line.close()
    line.close()


HALTED = """
import sys
from twbal.link.transport import SerialTransport
line = SerialTransport(sys.argv[1], 115200)
for number in range(2000):
    line.write(bytes([number % 251]) * 100)
print("all written", flush=True)
sys.stdin.read()  # a kernel may drop what is still on its way when the port is closed
"""


def test_a_process_that_is_halted_while_it_writes_goes_on(port):
    far, path = port
    host = subprocess.Popen(
        [sys.executable, "-c", HALTED, path], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
    got = b""
    while not got:
        with suppress(OSError):  # EIO: the host has not opened it yet
            got = os.read(far, 4096)  # from then on the line is full, and the host within a write
    host.send_signal(signal.SIGSTOP)
    time.sleep(1.3)  # longer than a write may take
    host.send_signal(signal.SIGCONT)
    while len(got) < 2000 * 100 and select.select([far], [], [], 30)[0]:
        with suppress(OSError):  # EIO: the host has failed, and says why below
            got += os.read(far, 65536)
            continue
        break
    assert (host.communicate()[0], host.returncode) == (b"all written\n", 0)
    assert len(got) >= 2000 * 100
    assert set(got) == set(range(251))


def test_a_line_that_takes_nothing_is_lost(port, monkeypatch):
    monkeypatch.setattr(transport, "_WRITE_TIMEOUT", 0.1)
    line = SerialTransport(port[1], 115200)
    with pytest.raises(LinkLostError, match="gone while writing"):
        for _ in range(1000):
            line.write(bytes(100))
    line.close()


def test_a_robot_behind_a_socket_is_driven_by_the_same_code():
    pendulum = Pendulum()
    firmware = Firmware(pendulum, Identity("far away", 20.0, 1.0, 0.1, Clock.LOCKSTEP))

    def robot(server):
        connection, _ = server.accept()
        with connection:
            while data := connection.recv(4096):
                connection.sendall(firmware.receive(data, 0))

    with socket.create_server(("127.0.0.1", 0)) as server:
        thread = threading.Thread(target=robot, args=[server])
        thread.start()
        cfg = OmegaConf.load(CONF / "groups" / "link.yaml").serial
        cfg.update(port=f"socket://127.0.0.1:{server.getsockname()[1]}", confirm_placed=None)
        with instantiate(cfg) as plant:
            assert isinstance(plant, SerialPlant)
            assert plant.robot_name == "far away"
            plant.reset(0)
            for torque in (1.0, 2.0, 3.0):
                plant.step(torque)
        thread.join()
    assert pendulum.torques == [1.0, 2.0, 3.0, None]


@pytest.fixture
def connection():
    """A transport over a socket, and the other end of it."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        line = SerialTransport(f"socket://127.0.0.1:{server.getsockname()[1]}", 115200)
        far, _ = server.accept()
        with far:
            yield line, far
    line.close()


def test_what_has_come_over_a_socket_is_read_at_once(connection):
    line, far = connection
    far.sendall(bytes(range(200)))
    time.sleep(0.1)
    assert line.read() == bytes(range(200))
    assert line.read() == b""


def test_a_command_over_a_socket_does_not_wait_for_the_next(connection):
    line, _ = connection
    assert line._port._socket.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)


def test_a_socket_that_is_closed_is_a_lost_link(connection):
    line, far = connection
    far.close()
    with pytest.raises(LinkLostError, match="gone while reading: its other end is gone"):
        line.read()
