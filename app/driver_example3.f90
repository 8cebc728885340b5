!> Example 3 of the paper: a free rigid body, N steps, attitude a matrix, exact or with np Gauss points.
program driver_example3
    use frb_driver_free, only: run_free_body
    implicit none

    call run_free_body(3)

end program driver_example3
