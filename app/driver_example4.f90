!> Example 4 of the paper: a free rigid body, N steps, attitude a quaternion, exact or with np Gauss points.
program driver_example4
    use frb_driver_free, only: run_free_body
    implicit none

    call run_free_body(4)

end program driver_example4
