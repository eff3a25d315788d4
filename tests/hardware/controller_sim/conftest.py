"""Connections to the simulated controller, byte by byte."""

import socket

import pytest


@pytest.fixture
def dial(controller):
    """Opens sockets to ports of the controller and closes them at the end."""
    opened = []

    def connect(port, data=b""):
        client = socket.create_connection((controller.host, port), timeout=20.0)
        opened.append(client)
        client.sendall(data)
        return client

    yield connect
    for client in opened:
        client.close()


@pytest.fixture
def is_alive(dial):
    """Whether the dashboard still answers."""

    def ask():
        client = dial(29999, b"robotmode\n").makefile()
        client.readline()
        return client.readline() == "Robotmode: RUNNING\n"

    return ask
