"""What the nodes share: messages, parameters, qualities of service, running and stopping."""
